// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_editing.h"

#include <limits>

namespace bundle_icp {
namespace {

/** The number of the connected component of each vertex that has triangles. */
std::vector<std::uint32_t>
findComponents(const SurfaceMesh& mesh)
{
  constexpr auto unseen = std::numeric_limits<std::uint32_t>::max();
  const HalfEdges edges(mesh.triangles, mesh.vertices.size());
  std::vector<std::uint32_t> components(mesh.vertices.size(), unseen), open;
  std::uint32_t count = 0;
  for (const Triangle& triangle : mesh.triangles) {
    if (components[triangle[0]] != unseen)
      continue;
    components[triangle[0]] = count;
    for (open.push_back(triangle[0]); !open.empty();) {
      const std::uint32_t vertex = open.back();
      open.pop_back();
      edges.forEachLeaving(vertex, [&](std::uint32_t h) {
        for (const std::uint32_t other : mesh.triangles[h / 3])
          if (components[other] == unseen) {
            components[other] = count;
            open.push_back(other);
          }
      });
    }
    ++count;
  }
  return components;
}

} // namespace

std::size_t
removeSmallAreas(SurfaceMesh& mesh, double min_area)
{
  const std::vector<std::uint32_t> components = findComponents(mesh);
  std::vector<double> areas;
  for (const Triangle& triangle : mesh.triangles) {
    const std::uint32_t component = components[triangle[0]];
    areas.resize(std::max<std::size_t>(areas.size(), component + 1), 0);
    areas[component] += areaNormal(mesh, triangle).norm() / 2;
  }
  std::vector<std::uint8_t> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t)
    keep[t] = areas[components[mesh.triangles[t][0]]] >= min_area;
  keepTriangles(mesh, keep);
  return std::count_if(areas.begin(), areas.end(),
                       [min_area](double area) { return area < min_area; });
}

} // namespace bundle_icp
