// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/mesh_cleaning.h>
#include <bundle_icp/mesh/mesh_decimation.h>
#include <bundle_icp/mesh/mesh_smoothing.h>
#include <bundle_icp/mesh/surface_mesh.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <string>

namespace bundle_icp {

/** Which surface of a volume is taken, and how it is smoothed and cleaned. */
struct BUNDLE_ICP_EXPORT MeshOptions {
  /** Weight that a voxel needs to take part, > 0; 1 = a frontal measurement at 1 m, 0.001 = one at
   *  5 m, slanted by 60 degrees. Raise it to drop what few or poor measurements saw, lower it for
   *  scans from far away. */
  double min_weight = 0.001;
  /** Distance at which the surface is taken, in truncations, from 0 (the surface) to
   *  below 1 (in front of it): what pcl::MarchingCubes calls the iso level. */
  double iso_level = 0;
  MeshSmoothingOptions smoothing;   ///< of noise; its num_threads gives way to the one below
  MeshCleaningOptions cleaning;     ///< small components, holes
  MeshDecimationOptions decimation; ///< fewer triangles
  int num_threads = 0;              ///< 0 = all

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** What became of a mesh after marching cubes. */
struct MeshReport {
  MeshCleaningResult cleaning;
  MeshDecimationResult decimation;
};

/** Marching cubes over the blocks of a volume, then smoothing, cleaning and decimation.
 *
 *  Every vertex comes from strictly inside one edge of the voxel grid and is shared by all
 *  triangles around it, so that no two coincide and no triangle has zero area, as long as
 *  single precision tells a hundredth of a voxel: up to 500 m from the origin at 5 mm. The mesh
 *  is closed where all voxels around the surface have been observed. The result is the
 *  same, order included, for any number of threads. Vertices without colour are grey.
 *
 *  The standard deviation of a vertex is what depth noise leaves after fusion:
 *    r sigma(1 m) sqrt(s / W) / |grad D|
 *  with the noise of TSDFOptions, the vertex' weight W, the gradient of the distance D, which turns
 *  a distance along the optical axis into one along the normal, and the share s of the variance
 *  that smoothing of depth leaves, which depends on TSDFOptions::smoothing_radius, and r of the
 *  deviation that MeshOptions::smoothing leaves. It is too large by a factor of up to 2.5 on near
 *  surfaces and too small by up to 1.5 on far ones, whose noise spreads over more of the mesh. That
 *  is of noise alone: errors of poses and calibration, flying pixels at outlines and the rounding
 *  of edges come on top.
 *  \throws pcl::BadArgumentException for invalid options. */
BUNDLE_ICP_EXPORT SurfaceMesh
extractSurface(const TSDFVolume& volume, const MeshOptions& options = {},
               MeshReport* report = nullptr);

/** The same, for a volume that is not needed any more: its memory is freed before the mesh is
 *  smoothed, which needs more than the mesh itself. Afterwards the volume can only be destroyed or
 *  assigned to. */
BUNDLE_ICP_EXPORT SurfaceMesh
extractSurface(TSDFVolume&& volume, const MeshOptions& options = {}, MeshReport* report = nullptr);

} // namespace bundle_icp
