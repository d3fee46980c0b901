// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/mesh_editing.h"

#include <pcl/exceptions.h>

#include <algorithm>
#include <string>

namespace bundle_icp {

void
checkLists(const SurfaceMesh& mesh, const char* caller)
{
  const std::size_t size = mesh.vertices.size();
  const auto check = [&](const char* name, std::size_t entries) {
    if (entries != 0 && entries != size)
      throw pcl::BadArgumentException(std::string(caller) + ": the mesh has " +
                                      std::to_string(size) + " vertices, but " +
                                      std::to_string(entries) + " " + name);
  };
  check("normals", mesh.normals.size());
  check("colors", mesh.colors.size());
  check("weights", mesh.weights.size());
  check("deviations", mesh.deviations.size());
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= size)
        throw pcl::BadArgumentException(std::string(caller) + ": a triangle names vertex " +
                                        std::to_string(vertex) + " of " + std::to_string(size));
}

void
keepTriangles(SurfaceMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (keep[t])
      mesh.triangles[count++] = mesh.triangles[t];
  mesh.triangles.resize(count);
}

void
removeUnusedVertices(SurfaceMesh& mesh)
{
  constexpr std::uint32_t used = 1;
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), 0);
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      numbers[vertex] = used;
  if (std::count(numbers.begin(), numbers.end(), used) == std::ptrdiff_t(numbers.size()))
    return;
  editVertexLists(mesh, [&numbers](auto& list) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < list.size(); ++i)
      if (numbers[i] == used)
        list[count++] = list[i];
    list.resize(count);
  });
  std::uint32_t count = 0;
  for (std::uint32_t& number : numbers)
    number = number == used ? count++ : 0;
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& vertex : triangle)
      vertex = numbers[vertex];
}

MeshEdges::MeshEdges(const std::vector<Triangle>& triangles, std::size_t num_vertices)
: triangles_(triangles), begin_(num_vertices + 1, 0), half_edges_(3 * triangles.size())
{
  const auto smaller = [this](std::uint32_t h) { return std::min(from(h), to(h)); };
  const auto count = static_cast<std::uint32_t>(half_edges_.size());
  for (std::uint32_t h = 0; h < count; ++h)
    ++begin_[smaller(h) + 1];
  for (std::size_t v = 0; v < num_vertices; ++v)
    begin_[v + 1] += begin_[v];
  std::vector<std::uint32_t> end(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t h = 0; h < count; ++h)
    half_edges_[end[smaller(h)]++] = h;
  // Some six half-edges each; their numbers decide between those of one edge.
  for (std::size_t v = 0; v < num_vertices; ++v)
    std::sort(half_edges_.begin() + begin_[v],
              half_edges_.begin() + begin_[v + 1],
              [this](std::uint32_t a, std::uint32_t b) {
                const std::uint32_t to_a = larger(a), to_b = larger(b);
                return to_a != to_b ? to_a < to_b : a < b;
              });
}

bool
MeshEdges::areJoined(std::uint32_t a, std::uint32_t b) const
{
  const std::uint32_t first = std::min(a, b), second = std::max(a, b);
  for (std::uint32_t i = begin_[first]; i < begin_[first + 1]; ++i)
    if (larger(half_edges_[i]) == second)
      return true;
  return false;
}

std::vector<std::int64_t>
MeshEdges::opposites() const
{
  std::vector<std::int64_t> opposites(half_edges_.size(), -1);
  forEachEdge([&](const std::uint32_t* first, const std::uint32_t* last) {
    if (last - first != 2)
      return;
    opposites[first[0]] = first[1];
    opposites[first[1]] = first[0];
  });
  return opposites;
}

} // namespace bundle_icp
