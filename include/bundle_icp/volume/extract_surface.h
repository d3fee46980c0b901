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

/** Which surface of a volume is extracted, and how it is smoothed and cleaned. */
struct BUNDLE_ICP_EXPORT MeshOptions {
  /** Minimum weight of a voxel that takes part, > 0; 1 = a frontal measurement at 1 m, 0.001 = one
   *  at 5 m, slanted by 60 degrees. A higher value drops surfaces with few or poor measurements; a
   *  lower value suits scans from far away. */
  double min_weight = 0.001;
  /** Signed distance at which the surface is extracted, in truncations, from 0 (the surface) to
   *  below 1 (in front of it). pcl::MarchingCubes calls it the iso level. */
  double iso_level = 0;
  MeshSmoothingOptions smoothing;   ///< removes noise; its num_threads gives way to the one below
  MeshCleaningOptions cleaning;     ///< removes small components, closes holes
  MeshDecimationOptions decimation; ///< reduces the number of triangles
  int num_threads = 0;              ///< 0 = all

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** What cleaning and decimation did to a mesh after marching cubes. */
struct MeshReport {
  MeshCleaningResult cleaning;
  MeshDecimationResult decimation;
};

/** Marching cubes over the blocks of a volume, then smoothing, cleaning and decimation.
 *
 *  Every vertex lies strictly inside one edge of the voxel grid, and all triangles around it share
 *  it. So no two vertices coincide and no triangle has zero area, as long as single precision
 *  resolves a hundredth of a voxel: up to 500 m from the origin at 5 mm. The mesh is closed where
 *  all voxels around the surface have been observed. The result, order included, is the same for
 *  any number of threads. Vertices without colour are grey.
 *
 *  The standard deviation of a vertex is the depth noise that remains after fusion:
 *    r sigma(1 m) sqrt(s / W) / |grad D|
 *  with sigma of the first camera's depth noise, the vertex' weight W, the gradient of the distance
 *  D, which turns a distance along the optical axis into one along the normal, the share s of the
 *  variance that smoothing of depth leaves (it depends on TSDFOptions::smoothing_radius), and the
 *  share r of the deviation that MeshOptions::smoothing leaves. The deviation is too large by a
 *  factor of up to 2.5 on near surfaces and too small by up to 1.5 on far surfaces, whose noise
 *  spreads over more of the mesh. It covers noise alone: errors of poses and calibration, flying
 *  pixels at outlines and the rounding of edges add to it.
 *  \throws pcl::BadArgumentException for invalid options. */
BUNDLE_ICP_EXPORT SurfaceMesh
extractSurface(const TSDFVolume& volume, const MeshOptions& options = {},
               MeshReport* report = nullptr);

/** The same for a volume that is not needed any more. Smoothing needs more memory than the mesh, so
 *  the volume's memory is freed first. Afterwards the volume can only be destroyed or assigned
 *  to. */
BUNDLE_ICP_EXPORT SurfaceMesh
extractSurface(TSDFVolume&& volume, const MeshOptions& options = {}, MeshReport* report = nullptr);

} // namespace bundle_icp
