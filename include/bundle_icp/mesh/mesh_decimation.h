// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <string>

namespace bundle_icp {

/** When decimateMesh() ends: at whichever limit it meets first. Without any it leaves the mesh
 *  as it is. */
struct BUNDLE_ICP_EXPORT MeshDecimationOptions {
  std::size_t max_triangles =
      0; ///< ends with so many or, boundaries permitting, fewer; 0 = no goal
  /** No vertex of the mesh that came in gets farther than this from the mesh that goes out
   *  [m]; 0 = no limit. */
  double max_error = 0;

  /** True when there is a limit to work towards. */
  bool
  isActive() const
  {
    return max_triangles > 0 || max_error > 0;
  }

  bool
  isValid(std::string* error = nullptr) const;
};

/** What became of a mesh, and by how much it deviates. */
struct MeshDecimationResult {
  std::size_t triangles_before = 0, triangles_after = 0;
  /** Largest and root mean square distance of the vertices before to the mesh after [m]:
   *  what was lost. Of upper bounds: each vertex is compared with the triangles that took the
   *  place of its own. */
  double max_error = 0, rms_error = 0;
  /** Largest distance of vertices, middles of edges and of triangles after to the mesh before
   *  [m]: what was made up. Of upper bounds: each is compared with the triangles around the
   *  nearest vertex before. */
  double max_reverse_error = 0;

  /** The stated error: the larger of both directions [m]. */
  double
  statedError() const
  {
    return max_error > max_reverse_error ? max_error : max_reverse_error;
  }
};

/** Collapses edges in the order of their quadric error (Garland and Heckbert, Surface
 *  simplification using quadric error metrics, SIGGRAPH 1997) as long as the limits permit.
 *
 *  Boundaries move only along themselves, no triangle turns over or loses its area, the
 *  surface keeps its topology. Normals, colours, weights and deviations are interpolated
 *  along the collapsed edges. Serial, hence the same with any number of threads.
 *  \throws pcl::BadArgumentException for invalid options, lists whose sizes differ, triangles
 *  that name no vertex, vertices that are not finite. */
BUNDLE_ICP_EXPORT MeshDecimationResult
decimateMesh(SurfaceMesh& mesh, const MeshDecimationOptions& options);

/** The same for PCL's meshes, see toSurfaceMesh(). */
BUNDLE_ICP_EXPORT MeshDecimationResult
decimateMesh(pcl::PolygonMesh& mesh, const MeshDecimationOptions& options);

} // namespace bundle_icp
