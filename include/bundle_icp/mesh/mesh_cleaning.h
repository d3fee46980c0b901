// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <string>

namespace bundle_icp {

/** What cleanMesh() does. Lengths do not depend on the size of voxels or triangles. */
struct BUNDLE_ICP_EXPORT MeshCleaningOptions {
  /** Connected components of less area are removed [m^2]; 0 = none. The default is a patch
   *  of 4.5 cm squared: specks go, cups stay. */
  double min_component_area = 0.002;
  /** Holes whose boundary is at most this long [m] and of at most 1000 edges are closed, 0 = none:
   *  a round hole of diameter d has about pi d. What closes them was not measured. */
  double max_hole_perimeter = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** What cleanMesh() changed. */
struct MeshCleaningResult {
  std::size_t duplicate_vertices = 0;     ///< merged with another at the same place
  std::size_t degenerate_triangles = 0;   ///< removed: no area, not finite, or there twice
  std::size_t non_manifold_triangles = 0; ///< removed: third at an edge, or beyond
  std::size_t flipped_triangles = 0;      ///< turned to agree with their neighbours
  std::size_t small_components = 0;       ///< removed
  std::size_t holes_filled = 0;
  double filled_area = 0; ///< of the triangles that fill them [m^2]
};

/** Makes a mesh fit for measuring and for further work, in this order: vertices at the same place
 *  become one; triangles without area go; edges keep at most two triangles, of more the largest;
 *  neighbours are oriented alike, and components as their normals say, or without normals outwards
 *  if they are closed, else as most of their triangles; small components go; holes are closed;
 *  vertices without triangle go. What is in order stays as it is, order of vertices and triangles
 *  included.
 *
 *  Not touched: vertices at which two sheets meet in one point, sheets that run through
 *  each other, components that cannot be oriented, such as a Moebius strip.
 *  \throws pcl::BadArgumentException for invalid options, and for lists whose sizes differ
 *  or triangles that name no vertex. */
BUNDLE_ICP_EXPORT MeshCleaningResult
cleanMesh(SurfaceMesh& mesh, const MeshCleaningOptions& options = {});

/** The same for PCL's meshes, see toSurfaceMesh(). */
BUNDLE_ICP_EXPORT MeshCleaningResult
cleanMesh(pcl::PolygonMesh& mesh, const MeshCleaningOptions& options = {});

} // namespace bundle_icp
