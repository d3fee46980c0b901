// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/mesh_editing.h"

#include <bundle_icp/surface/mesh_cleaning.h>

#include <pcl/exceptions.h>

#include <cmath>
#include <numeric>
#include <string>

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

/** Removes the components whose triangles' sizes do not add up to `min_size`. */
template <typename SizeOf>
std::size_t
removeComponents(SurfaceMesh& mesh, double min_size, const SizeOf& sizeOf)
{
  VertexSets sets(mesh.vertices.size());
  for (const Triangle& triangle : mesh.triangles) {
    sets.join(triangle[0], triangle[1]);
    sets.join(triangle[0], triangle[2]);
  }
  std::vector<double> sizes(mesh.vertices.size(), -1); // by root; -1 = no component's
  for (const Triangle& triangle : mesh.triangles) {
    double& size = sizes[sets.root(triangle[0])];
    size = std::max(size, 0.0) + sizeOf(triangle);
  }
  std::vector<std::uint8_t> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t)
    keep[t] = sizes[sets.root(mesh.triangles[t][0])] >= min_size;
  keepTriangles(mesh, keep);
  removeUnusedVertices(mesh);
  return std::count_if(sizes.begin(), sizes.end(), [min_size](double size) {
    return size >= 0 && size < min_size;
  });
}

} // namespace

std::size_t
removeSmallAreas(SurfaceMesh& mesh, double min_area)
{
  if (!(min_area >= 0 && std::isfinite(min_area)))
    throw pcl::BadArgumentException("removeSmallAreas: min_area " + std::to_string(min_area) +
                                    "; expected 0 (none) or more square metres");
  checkLists(mesh, "removeSmallAreas");
  return removeComponents(mesh, min_area, [&mesh](const Triangle& triangle) {
    const double area = areaNormal(mesh, triangle).norm() / 2;
    return std::isfinite(area) ? area : 0;
  });
}

} // namespace bundle_icp
