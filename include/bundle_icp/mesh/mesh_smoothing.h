// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <string>

namespace bundle_icp {

/** How far smoothMesh() goes. */
struct BUNDLE_ICP_EXPORT MeshSmoothingOptions {
  /** Each lets vertices move towards what their neighbours say, 0 (the mesh stays as it is) to
   *  1000. What is smoothed is about sqrt(iterations) edges wide. */
  int iterations = 2;
  int num_threads = 0; ///< 0 = all

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** Takes the noise off a mesh that says how noisy it is, and nothing else.
 *
 *  Normals become the mean of those around that point the same way. Then vertices move along
 *  them, towards the surface that their neighbours lie on, by the mean of
 *    (n_i + n_j) . (p_j - p_i) / 2
 *  which is zero on planes, spheres and cylinders, so that round things do not shrink. Each
 *  neighbour counts by the inverse of its variance, less the farther it is off in standard
 *  deviations (Tukey's biweight), and not at all beyond three: edges and steps that the
 *  measurements tell from noise stay. Vertices move along normals only, so that triangles keep
 *  their extent along the surface. The result is the same for any number of threads.
 *
 *  Standard deviations are those after smoothing. Meshes without normals or deviations stay
 *  as they are: they do not say what is noise.
 *  \throws pcl::BadArgumentException for invalid options, and for lists whose sizes differ
 *  or triangles that name no vertex. */
BUNDLE_ICP_EXPORT void
smoothMesh(SurfaceMesh& mesh, const MeshSmoothingOptions& options = {});

} // namespace bundle_icp
