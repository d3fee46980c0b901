// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/virtual_depth.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {

/** Decides whether two neighbouring depths belong to one surface. A step counts as an
 * edge when neither noise nor the steepest surface that takes part explains it. */
struct SurfaceLink {
  float constant, quadratic, offset; ///< edge_sigmas times the noise model
  float slope;                       ///< largest step of a surface, per metre of depth

  SurfaceLink(const CameraIntrinsics& camera, const VirtualDepthOptions& options)
      : constant(static_cast<float>(options.edge_sigmas * options.noise.constant)),
        quadratic(static_cast<float>(options.edge_sigmas * options.noise.quadratic)),
        offset(static_cast<float>(options.noise.offset)),
        slope(static_cast<float>(std::tan(options.max_view_angle * M_PI / 180) /
                                 std::min(camera.fx, camera.fy)))
  {
  }

  /** Largest step between neighbours of one surface at depth z [m]. */
  float
  tolerance(float z) const
  {
    const float d = z - offset;
    const float noise = constant + quadratic * d * d, steepest = slope * z;
    return noise > steepest ? noise : steepest;
  }

  /** 1 when depths a and b [m] are linked; 0 across an edge and for NaN. */
  float
  operator()(float a, float b) const
  {
    const float nearer = a < b ? a : b;
    return std::abs(a - b) <= tolerance(nearer) ? 1.0f : 0.0f;
  }
};

} // namespace bundle_icp
