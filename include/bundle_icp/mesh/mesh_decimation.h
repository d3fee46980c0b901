// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <string>

namespace bundle_icp {

/** Limits of decimateMesh(): the first limit that it meets ends it. Without a limit the mesh does
 *  not change. */
struct BUNDLE_ICP_EXPORT MeshDecimationOptions {
  std::size_t max_triangles =
      0; ///< wanted number of triangles; boundaries may need fewer; 0 = no goal
  /** Largest distance of a vertex of the input mesh from the output mesh [m]; 0 = no limit. */
  double max_error = 0;

  /** True when there is a limit. */
  bool
  isActive() const
  {
    return max_triangles > 0 || max_error > 0;
  }

  bool
  isValid(std::string* error = nullptr) const;
};

/** Result of decimateMesh(), with the deviation of the mesh. */
struct MeshDecimationResult {
  std::size_t triangles_before = 0, triangles_after = 0;
  /** Lost surface: largest and root mean square distance of the input vertices to the output mesh
   *  [m], from upper bounds: each vertex is compared with the triangles that replaced its own
   *  triangles. */
  double max_error = 0, rms_error = 0;
  /** Invented surface: largest distance of vertices, edge centres and triangle centres of the
   *  output to the input mesh [m], from upper bounds: each point is compared with the triangles
   *  around the nearest input vertex. */
  double max_reverse_error = 0;

  /** The stated error: the larger of max_error and max_reverse_error [m]. */
  double
  statedError() const
  {
    return max_error > max_reverse_error ? max_error : max_reverse_error;
  }
};

/** Collapses edges in the order of their quadric error (Garland and Heckbert, Surface
 *  simplification using quadric error metrics, SIGGRAPH 1997) as long as the limits permit.
 *
 *  Boundaries move only along themselves, no triangle turns over or loses its area, and the surface
 *  keeps its topology. Normals, colours, weights and deviations are interpolated along the
 *  collapsed edges. The function is serial, so the result is the same for any number of threads.
 *  \throws pcl::BadArgumentException for invalid options, lists of different size, triangles that
 *  name no vertex, or vertices that are not finite. */
BUNDLE_ICP_EXPORT MeshDecimationResult
decimateMesh(SurfaceMesh& mesh, const MeshDecimationOptions& options);

/** The same for PCL's meshes, see toSurfaceMesh(). */
BUNDLE_ICP_EXPORT MeshDecimationResult
decimateMesh(pcl::PolygonMesh& mesh, const MeshDecimationOptions& options);

} // namespace bundle_icp
