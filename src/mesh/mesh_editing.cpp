// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_editing.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace bundle_icp {

void
checkLists(const SurfaceMesh& mesh, const char* caller)
{
  const std::size_t size = mesh.vertices.size();
  const auto check = [&](const char* name, std::size_t entries) {
    if (entries != 0 && entries != size)
      throw BadArgumentException(std::string(caller) + ": the mesh has " + std::to_string(size) +
                                 " vertices, but " + std::to_string(entries) + " " + name);
  };
  check("normals", mesh.normals.size());
  check("colors", mesh.colors.size());
  check("weights", mesh.weights.size());
  check("deviations", mesh.deviations.size());
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= size)
        throw BadArgumentException(std::string(caller) + ": a triangle names vertex " +
                                   std::to_string(vertex) + " of " + std::to_string(size));
}

void
blendAttributes(SurfaceMesh& mesh, std::uint32_t to, std::uint32_t from, double share)
{
  const auto s = float(share);
  const auto blend = [s](float a, float b) { return (1 - s) * a + s * b; };
  if (!mesh.normals.empty()) {
    const Eigen::Vector3f normal = (1 - s) * mesh.normals[to] + s * mesh.normals[from];
    if (normal.squaredNorm() > 0)
      mesh.normals[to] = normal.normalized();
  }
  if (!mesh.colors.empty())
    for (int i = 0; i < 3; ++i)
      mesh.colors[to][i] =
          std::uint8_t(std::lround(blend(mesh.colors[to][i], mesh.colors[from][i])));
  for (auto* list : {&mesh.weights, &mesh.deviations})
    if (!list->empty())
      (*list)[to] = blend((*list)[to], (*list)[from]);
}

std::size_t
keepTriangles(SurfaceMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (keep[t])
      mesh.triangles[count++] = mesh.triangles[t];
  mesh.triangles.resize(count);
  return keep.size() - count;
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

HalfEdges::HalfEdges(const std::vector<Triangle>& triangles, std::size_t num_vertices)
: triangles_(triangles), begin_(num_vertices + 2, 0), half_edges_(3 * triangles.size())
{
  const auto count = std::uint32_t(half_edges_.size());
  for (std::uint32_t h = 0; h < count; ++h)
    ++begin_[from(h) + 2];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  for (std::uint32_t h = 0; h < count; ++h)
    half_edges_[begin_[from(h) + 1]++] = h; // which moves it on to where the next begins
  begin_.pop_back();
}

bool
HalfEdges::areJoined(std::uint32_t a, std::uint32_t b) const
{
  bool joined = false;
  forEachLeaving(a, [&](std::uint32_t h) { joined |= to(h) == b || from(next(next(h))) == b; });
  return joined;
}

std::vector<std::int64_t>
HalfEdges::opposites() const
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
