// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/surface/mesh_cleaning.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace bundle_icp {

using Triangle = std::array<std::uint32_t, 3>;

/** Refuses a mesh whose lists do not belong together; `caller` begins the message.
 *  \throws pcl::BadArgumentException */
void
checkLists(const SurfaceMesh& mesh, const char* caller);

/** Calls edit(list) for each list of one entry per vertex that the mesh has. */
template <typename Edit>
void
editVertexLists(SurfaceMesh& mesh, const Edit& edit)
{
  edit(mesh.vertices);
  if (!mesh.normals.empty())
    edit(mesh.normals);
  if (!mesh.colors.empty())
    edit(mesh.colors);
  if (!mesh.weights.empty())
    edit(mesh.weights);
  if (!mesh.deviations.empty())
    edit(mesh.deviations);
}

/** cleanMesh() for what marching cubes give, which has no duplicate vertex, no triangle without
 *  area, at most two triangles at an edge, and is oriented. */
MeshCleaningResult
cleanExtracted(SurfaceMesh& mesh, const MeshCleaningOptions& options);

/** Keeps the triangles whose flag is set, in their order. */
void
keepTriangles(SurfaceMesh& mesh, const std::vector<std::uint8_t>& keep);

/** Removes vertices that no triangle names; the others keep their order. */
void
removeUnusedVertices(SurfaceMesh& mesh);

inline Eigen::Vector3d
corner(const SurfaceMesh& mesh, const Triangle& triangle, int i)
{
  return mesh.vertices[triangle[i]].cast<double>();
}

/** Normal of a triangle, as long as twice its area [m^2]. */
inline Eigen::Vector3d
areaNormal(const SurfaceMesh& mesh, const Triangle& triangle)
{
  const Eigen::Vector3d a = corner(mesh, triangle, 0);
  return (corner(mesh, triangle, 1) - a).cross(corner(mesh, triangle, 2) - a);
}

/** True where a triangle is so narrow that it has no normal to speak of: its height is less
 *  than a share of its longest edge. */
inline bool
isNarrow(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, double share)
{
  const double longest =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !((b - a).cross(c - a).norm() > share * longest);
}

/** The edges of a mesh. Half-edge 3 t + i runs from corner i of triangle t to the next. */
class MeshEdges {
public:
  explicit MeshEdges(const std::vector<Triangle>& triangles, std::size_t num_vertices);

  std::uint32_t
  from(std::uint32_t half_edge) const
  {
    return triangles_[half_edge / 3][half_edge % 3];
  }

  std::uint32_t
  to(std::uint32_t half_edge) const
  {
    return triangles_[half_edge / 3][(half_edge % 3 + 1) % 3];
  }

  /** The half-edge after this one in its triangle. */
  static std::uint32_t
  next(std::uint32_t half_edge)
  {
    return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1;
  }

  /** Calls visit(first, last), a range of half-edges of either direction, for each edge, in an
   *  order that follows from the mesh. */
  template <typename Visit>
  void
  forEachEdge(const Visit& visit) const
  {
    for (std::size_t v = 0; v + 1 < begin_.size(); ++v)
      for (std::uint32_t i = begin_[v], j = i; i < begin_[v + 1]; i = j) {
        while (j < begin_[v + 1] && larger(half_edges_[j]) == larger(half_edges_[i]))
          ++j;
        visit(half_edges_.data() + i, half_edges_.data() + j);
      }
  }

  bool
  areJoined(std::uint32_t a, std::uint32_t b) const;

  /** The other half-edge of each edge that has two, else -1. */
  std::vector<std::int64_t>
  opposites() const;

private:
  std::uint32_t
  larger(std::uint32_t half_edge) const
  {
    return std::max(from(half_edge), to(half_edge));
  }

  const std::vector<Triangle>& triangles_;
  std::vector<std::uint32_t> begin_;      // by the smaller vertex of the edge
  std::vector<std::uint32_t> half_edges_; // sorted by the larger one therein
};

} // namespace bundle_icp
