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

/** A disc on a leg with things on it. z is the axis, the disc's top is at z = 0. */
Scene
turntableScene(const SyntheticScanOptions& options);

/** Where the turntable is in the room at a time [s], 0.75 m before a camera. */
Pose
roomFromTurntable(const Pose& room_from_camera, double time);

/** What moves against the scene: SyntheticScanOptions::gripper and person, and around a turntable
 *  the room. */
class MovingThings {
public:
  /** \param[in] world_from_room at a time [s] */
  MovingThings(const SyntheticScanOptions& options,
               const std::function<Pose(double time)>& world_from_room);

  /** Draws them over a rendered frame where they are nearer.
   *  \param[in] time of the frame on the path [s]
   *  \param[in,out] depth CV_32FC1 [m] of the scene without them, 0 = nothing is there
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
