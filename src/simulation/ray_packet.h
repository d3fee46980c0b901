// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scene.h"

#include <limits>
#include <opencv2/core/hal/intrin.hpp>

namespace bundle_icp {
namespace simulation {

/** Four neighbouring rays that look for their nearest primitive together, in single
 * precision: enough to know which one it is, not where it is met. */
struct RayPacket {
  cv::v_float32x4 depth = cv::v_setall_f32(std::numeric_limits<float>::infinity());
  cv::v_int32x4 nearest =
      cv::v_setall_s32(-1); ///< number of the nearest primitive so far

  /** Meets primitive `number`.
   *  \param[in] origin of the rays, in the primitive's frame
   *  \param[in] direction, step of the first ray, and from each ray to the next */
  void
  meet(const Primitive& primitive, int number, const Eigen::Vector3f& origin,
       const Eigen::Vector3f& direction, const Eigen::Vector3f& step);
};

} // namespace simulation
} // namespace bundle_icp
