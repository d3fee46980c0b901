// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <string>

namespace bundle_icp {

/** A camera pose that a recording brings, for example that of a phone, a robot arm or an IMU. Its
 *  world is any one: only motions between frames count. Errors add up from frame to frame, so that
 *  over n frames the deviations are sqrt(n) times those below. */
struct BUNDLE_ICP_EXPORT PosePrior {
  Pose world_from_camera = Pose::Identity();
  /** Standard deviation of the motion from the frame before in time, along each axis [m]. */
  double position_sigma = 0.01;
  /** The same of its rotation about each axis [rad]; 0.5 degrees. */
  double rotation_sigma = 0.5 * EIGEN_PI / 180;

  bool
  isValid(std::string* error = nullptr) const;
};

} // namespace bundle_icp
