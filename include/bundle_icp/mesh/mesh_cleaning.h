// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <string>

namespace bundle_icp {

/** Options of cleanMesh(). Lengths do not depend on the size of voxels or triangles. */
struct BUNDLE_ICP_EXPORT MeshCleaningOptions {
  /** Connected components with less area are removed [m^2]; 0 = none. The default is a patch of 4.5
   *  cm squared: specks go, cups stay. */
  double min_component_area = 0.002;
  /** Holes of at most 1000 edges and of at most this boundary length [m] are closed, 0 = none. The
   *  boundary of a round hole of diameter d is about pi d. The filling is not measured surface. */
  double max_hole_perimeter = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** What cleanMesh() changed. */
struct MeshCleaningResult {
  std::size_t duplicate_vertices = 0;     ///< vertices merged with another vertex at the same place
  std::size_t degenerate_triangles = 0;   ///< removed: no area, not finite, or duplicate
  std::size_t non_manifold_triangles = 0; ///< removed: third or later triangle at an edge
  std::size_t flipped_triangles = 0;      ///< turned to agree with their neighbours
  std::size_t small_components = 0;       ///< removed
  std::size_t holes_filled = 0;
  double filled_area = 0; ///< area of the triangles that fill holes [m^2]
};

/** Makes a mesh fit for measuring and further work, in this order: vertices at the same place are
 *  merged; triangles without area are removed; each edge keeps its two largest triangles;
 *  neighbours get the same orientation; components are turned as their normals say, or without
 *  normals outwards if closed, else as most of their triangles; small components are removed; holes
 *  are closed; vertices without triangles are removed. Correct parts keep their order of vertices
 *  and triangles.
 *
 *  Not touched: vertices where two sheets meet in one point, sheets that run through each other,
 *  components that cannot be oriented, such as a Moebius strip.
 *  \throws pcl::BadArgumentException for invalid options, lists of different size, or triangles
 *  that name no vertex. */
BUNDLE_ICP_EXPORT MeshCleaningResult
cleanMesh(SurfaceMesh& mesh, const MeshCleaningOptions& options = {});

/** The same for PCL's meshes, see toSurfaceMesh(). */
BUNDLE_ICP_EXPORT MeshCleaningResult
cleanMesh(pcl::PolygonMesh& mesh, const MeshCleaningOptions& options = {});

} // namespace bundle_icp
