// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/surface/tsdf_volume.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace bundle_icp {

/** Which surface of a volume is taken, and how it is cleaned. */
struct BUNDLE_ICP_EXPORT MeshOptions {
  /** Weight that a voxel needs to take part, > 0; 1 = a frontal measurement at 1 m.
   *  Raise it to drop what few or poor measurements saw, lower it for scans from far
   *  away. */
  double min_weight = 0.02;
  /** Connected components with fewer triangles are removed; 0 = none. */
  std::size_t min_component_triangles = 200;
  /** Distance at which the surface is taken, in truncations, from 0 (the surface) to
   *  below 1 (in front of it): what pcl::MarchingCubes calls the iso level. */
  double iso_level = 0;
  int num_threads = 0; ///< 0 = all

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** Triangles with shared vertices. */
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;           ///< world frame [m]
  std::vector<Eigen::Vector3f> normals;            ///< unit length, towards the cameras
  std::vector<std::array<std::uint8_t, 3>> colors; ///< red, green, blue
  std::vector<std::array<std::uint32_t, 3>>
      triangles; ///< counter-clockwise from outside
};

/** Marching cubes over the blocks of a volume.
 *
 *  Every vertex lies strictly inside one edge of the voxel grid and is shared by all
 *  triangles around it, so that no two coincide and no triangle has zero area. The mesh
 *  is closed where all voxels around the surface have been observed. The result is the
 *  same, order included, for any number of threads. Vertices without colour are grey.
 *  \throws pcl::BadArgumentException for invalid options. */
BUNDLE_ICP_EXPORT SurfaceMesh
extractSurface(const TSDFVolume& volume, const MeshOptions& options = {});

/** Removes connected components of fewer triangles, and vertices without triangle.
 *  Order is kept. */
BUNDLE_ICP_EXPORT void
removeSmallComponents(SurfaceMesh& mesh, std::size_t min_triangles);

} // namespace bundle_icp
