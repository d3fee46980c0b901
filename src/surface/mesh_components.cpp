// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/surface/extract_surface.h>

#include <limits>
#include <numeric>

namespace bundle_icp {
namespace {

/** Disjoint sets of vertices; the root of a set is its smallest member. */
class VertexSets {
public:
  explicit VertexSets(std::size_t size) : parent_(size)
  {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  std::uint32_t
  root(std::uint32_t vertex)
  {
    while (parent_[vertex] != vertex) {
      parent_[vertex] = parent_[parent_[vertex]];
      vertex = parent_[vertex];
    }
    return vertex;
  }

  void
  join(std::uint32_t a, std::uint32_t b)
  {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

private:
  std::vector<std::uint32_t> parent_;
};

constexpr std::uint32_t removed = std::numeric_limits<std::uint32_t>::max();

// Moves kept vertices together; returns their new numbers.
std::vector<std::uint32_t>
compactVertices(SurfaceMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), removed);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!keep[i])
      continue;
    mesh.vertices[count] = mesh.vertices[i];
    mesh.normals[count] = mesh.normals[i];
    mesh.colors[count] = mesh.colors[i];
    numbers[i] = count++;
  }
  mesh.vertices.resize(count);
  mesh.normals.resize(count);
  mesh.colors.resize(count);
  return numbers;
}

} // namespace

void
removeSmallComponents(SurfaceMesh& mesh, std::size_t min_triangles)
{
  VertexSets sets(mesh.vertices.size());
  for (const auto& triangle : mesh.triangles) {
    sets.join(triangle[0], triangle[1]);
    sets.join(triangle[0], triangle[2]);
  }
  std::vector<std::uint32_t> sizes(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles)
    ++sizes[sets.root(triangle[0])];
  std::vector<std::uint8_t> keep(mesh.vertices.size());
  for (std::uint32_t i = 0; i < keep.size(); ++i) {
    const std::uint32_t size = sizes[sets.root(i)];
    keep[i] = size > 0 && size >= min_triangles;
  }

  const std::vector<std::uint32_t> numbers = compactVertices(mesh, keep);
  std::size_t count = 0;
  for (const auto& triangle : mesh.triangles)
    if (keep[triangle[0]])
      mesh.triangles[count++] = {numbers[triangle[0]], numbers[triangle[1]],
                                 numbers[triangle[2]]};
  mesh.triangles.resize(count);
}

} // namespace bundle_icp
