// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scene.h"

#include <bundle_icp/common/pose.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <opencv2/core.hpp>

#include <functional>
#include <vector>

namespace bundle_icp {
namespace simulation {

/** What moves through the scene or with the camera: SyntheticScanOptions::gripper and person. */
class MovingThings {
public:
  explicit MovingThings(const SyntheticScanOptions& options);

  /** Draws them over a rendered frame where they are nearer.
   *  \param[in] time of the frame on the path [s]
   *  \param[in,out] depth CV_32FC1 [m] of the scene without them
   *  \param[in,out] color CV_8UC3, or nothing */
  void
  draw(const CameraIntrinsics& camera, const Pose& world_from_camera, double time, cv::Mat& depth,
       cv::Mat* color) const;

  /** Where they are in the image: CV_8UC1, 255 or 0.
   *  \param[in] depth CV_32FC1 [m] of the scene without them */
  cv::Mat
  coverage(const CameraIntrinsics& camera, const Pose& world_from_camera, double time,
           const cv::Mat& depth) const;

private:
  struct Thing {
    Scene scene; ///< in a frame of its own
    std::function<Pose(double time, const Pose& world_from_camera)> world_from_thing;
  };
  std::vector<Thing> things_;
};

} // namespace simulation
} // namespace bundle_icp
