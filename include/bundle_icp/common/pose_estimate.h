// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>

namespace bundle_icp {

/** A camera pose and how well it is known. */
struct PoseEstimate {
  Pose world_from_camera = Pose::Identity();
  /** Error that all pixels of the frame's depth image share. */
  DepthError depth_error = DepthError::Zero();
  /** Of the camera's rotation [rad] and position [m], along the axes of the world, given the
   *  model; a metre and a radian, or more, where a direction is open. */
  Matrix6d covariance = Matrix6d::Identity();
};

} // namespace bundle_icp
