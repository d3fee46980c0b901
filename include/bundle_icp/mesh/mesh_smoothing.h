// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <string>

namespace bundle_icp {

/** Strength of smoothMesh(). */
struct BUNDLE_ICP_EXPORT MeshSmoothingOptions {
  /** Number of passes, 0 (no change) to 1000. Each pass moves vertices towards the surface of their
   *  neighbours. Smoothing reaches about sqrt(iterations) edges. */
  int iterations = 2;
  int num_threads = 0; ///< 0 = all

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** Removes the noise from a mesh with known standard deviations, and changes nothing else.
 *
 *  First, normals become the mean of the surrounding normals that point the same way. Then vertices
 *  move along their normals towards the surface of their neighbours, by the mean of
 *    (n_i + n_j) . (p_j - p_i) / 2
 *  which is zero on planes, spheres and cylinders, so round objects do not shrink. Each neighbour
 *  counts by the inverse of its variance, less the more standard deviations it is away (Tukey's
 *  biweight), and not at all beyond three. So edges and steps that exceed the noise stay. Vertices
 *  move only along normals, so triangles keep their extent along the surface. The result is the
 *  same for any number of threads.
 *
 *  The mesh gets the standard deviations after smoothing. A mesh without normals or deviations does
 *  not change, because its noise is unknown.
 *  \throws pcl::BadArgumentException for invalid options, lists of different size, or triangles
 *  that name no vertex. */
BUNDLE_ICP_EXPORT void
smoothMesh(SurfaceMesh& mesh, const MeshSmoothingOptions& options = {});

} // namespace bundle_icp
