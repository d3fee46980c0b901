// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/mesh_cleaning.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace bundle_icp {

using Triangle = std::array<std::uint32_t, 3>;

/** Refuses a mesh with inconsistent lists; the message begins with `caller`. \throws
 *  pcl::BadArgumentException */
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

/** Calls edit(mesh) for a mesh in PCL's form. \return what that returns. */
template <typename Edit>
auto
editSurface(pcl::PolygonMesh& mesh, const Edit& edit)
{
  SurfaceMesh surface = toSurfaceMesh(mesh);
  const auto result = edit(surface);
  const pcl::PCLHeader header = mesh.header;
  mesh = toPolygonMesh(surface);
  mesh.header = header;
  return result;
}

/** cleanMesh() for a mesh of marching cubes: no duplicate vertex, no triangle without area, at most
 *  two triangles at an edge, all oriented. */
MeshCleaningResult
cleanExtracted(SurfaceMesh& mesh, const MeshCleaningOptions& options);

/** Removes connected components of less area [m^2]; order is kept. \return how many. */
std::size_t
removeSmallAreas(SurfaceMesh& mesh, double min_area);

/** Closes the holes of a clean mesh whose boundary is at most `max_perimeter` [m] and 1000 edges
 *  long, without new vertices: by the triangulation of the boundary with the shortest edges in sum.
 *  Holes where each would need a triangle without area, or an edge that exists already, stay open.
 *  */
void
fillHoles(SurfaceMesh& mesh, double max_perimeter, MeshCleaningResult& result);

/** Moves the attributes of vertex `to` towards those of `from`, by a share of 0 to 1. */
void
blendAttributes(SurfaceMesh& mesh, std::uint32_t to, std::uint32_t from, double share);

/** Keeps the triangles whose flag is set, in their order. \return how many went. */
std::size_t
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

inline Eigen::Vector3d
areaNormal(const std::vector<Eigen::Vector3d>& positions, const Triangle& triangle)
{
  const auto& [a, b, c] = triangle;
  return (positions[b] - positions[a]).cross(positions[c] - positions[a]);
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

/** The half-edges of a mesh by the vertex that they leave: half-edge 3 t + i runs from corner i of
 *  triangle t to the next. Triangles need not be oriented alike, edges and vertices may have any
 *  number of them. The one structure for all that asks what is next to what. */
class HalfEdges {
public:
  /** The triangles must outlive this. */
  HalfEdges(const std::vector<Triangle>& triangles, std::size_t num_vertices);

  std::uint32_t
  from(std::uint32_t half_edge) const
  {
    return triangles_[half_edge / 3][half_edge % 3];
  }

  std::uint32_t
  to(std::uint32_t half_edge) const
  {
    return from(next(half_edge));
  }

  /** The half-edge after this one in its triangle. */
  static std::uint32_t
  next(std::uint32_t half_edge)
  {
    return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1;
  }

  /** Calls visit(half_edge) for those that leave a vertex, one for each triangle around it. */
  template <typename Visit>
  void
  forEachLeaving(std::size_t vertex, const Visit& visit) const
  {
    for (std::uint32_t i = begin_[vertex]; i < begin_[vertex + 1]; ++i)
      visit(half_edges_[i]);
  }

  /** Calls visit(first, last), a range of half-edges of either direction, for each edge, in the
   *  order of its smaller and larger vertex. */
  template <typename Visit>
  void
  forEachEdge(const Visit& visit) const
  {
    using EndAndHalfEdge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<EndAndHalfEdge> larger;
    std::vector<std::uint32_t> edge;
    for (std::uint32_t v = 0; v + 1 < begin_.size(); ++v) {
      larger.clear();
      forEachLeaving(v, [&](std::uint32_t h) {
        const std::uint32_t entering = next(next(h));
        if (to(h) > v)
          larger.emplace_back(to(h), h);
        if (from(entering) > v)
          larger.emplace_back(from(entering), entering);
      });
      std::sort(larger.begin(), larger.end());
      for (auto i = larger.begin(); i != larger.end();) {
        edge.clear();
        for (const std::uint32_t end = i->first; i != larger.end() && i->first == end; ++i)
          edge.push_back(i->second);
        visit(edge.data(), edge.data() + edge.size());
      }
    }
  }

  bool
  areJoined(std::uint32_t a, std::uint32_t b) const;

  /** The other half-edge of each edge that has two, else -1. */
  std::vector<std::int64_t>
  opposites() const;

private:
  const std::vector<Triangle>& triangles_;
  std::vector<std::uint32_t> begin_; // by vertex
  std::vector<std::uint32_t> half_edges_;
};

} // namespace bundle_icp
