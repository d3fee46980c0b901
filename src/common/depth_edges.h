// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/depth_sigma.h"

#include <bundle_icp/common/camera_intrinsics.h>

#include <algorithm>

namespace bundle_icp {

/** The rule for depth edges: two depths of an image belong to one surface when noise and a slope
 *  explain their difference. */
class DepthEdges {
public:
  DepthEdges() = default;
  explicit DepthEdges(const CameraIntrinsics& camera)
  : noise_(camera.depth_noise, SIGMAS), slope_(float(STEEPEST / std::min(camera.fx, camera.fy)))
  {
  }

  /** Largest difference [m] from depth z [m] at so many pixels' distance on the same surface. A
   *  missing depth of 0 is never that near: noise counts up to half of z. */
  template <typename Real>
  BUNDLE_ICP_INLINE Real
  tolerance(Real z, float pixels = 1) const
  {
    const Real noise = noise_(z), most = 0.5f * z;
    return (noise < most ? noise : most) + (slope_ * pixels) * z;
  }

  /** 1 when neighbouring depths [m] belong to one surface; 0 across an edge and for NaN. */
  BUNDLE_ICP_INLINE float
  operator()(float a, float b) const
  {
    const float nearer = a < b ? a : b, difference = a < b ? b - a : a - b;
    return difference <= tolerance(nearer) ? 1.0f : 0.0f;
  }

private:
  /** Three standard deviations of the difference of two depths. */
  static constexpr double SIGMAS = 4.2;
  /** Tangent of 76 degrees, how far from frontal a surface may be turned. */
  static constexpr double STEEPEST = 4;

  DepthSigma noise_;
  float slope_ = 0;
};

} // namespace bundle_icp
