// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core.hpp>

#include <limits>

namespace bundle_icp {

/** What stays in the image while other things move: a part that is fixed to a moving camera, or the
 *  surroundings of a camera that stands still. */
class StayingPixels {
public:
  /** Mask of what moves with a moving camera: a gripper, a hand on the sensor, a part of its mount.
   *  CV_8UC1 of the size of the frames, not 0 where it is; empty when nothing is. */
  cv::Mat camera_fixed;
  /** Mask of a mark in the images of a moving camera, of the same form: its pixels show the surface
   *  behind it, but features on it do not move with that. */
  cv::Mat mark;
  /** Share of the measured pixels whose farthest depth and grey level stay, of all or of those on
   *  no plain surface, whichever is less; 0 where too few tell. */
  double share_of_surroundings = 0;
  /** Share of the image that differs from the surroundings, and share of the sampled frames in
   *  which it does, where the camera stands still. */
  double moving_share = 0, moving_frames = 0;

  /** Mask of all that must not count where the camera moves; empty when nothing is. */
  cv::Mat
  staysWithCamera() const;

  /** True when most of the image stays: it shows the surroundings. */
  bool
  cameraStandsStill() const
  {
    return share_of_surroundings > 0.5;
  }

  /** Mask of what a frame shows before the surroundings: pixels whose depth or grey level is not
   *  that of the farthest surface that several frames show there alike. CV_8UC1 of the size of the
   *  frame. */
  cv::Mat
  movingIn(const RGBDFrame& frame) const;

  /** Mask of the rest of the frame. At the border, where pixels show both, the masks overlap. */
  cv::Mat
  surroundingsIn(const RGBDFrame& frame) const;

private:
  friend class StayingPixelFinder;
  cv::Mat
  movingCells(const cv::Mat& depth, const cv::Mat& gray) const;

  DepthNoise noise_;
  cv::Mat depth_, gray_; ///< of the surroundings, in cells; 0 = unknown
  /** Depth beyond which nothing moves: surroundings that are hidden most of the time [m]. */
  float farthest_ = std::numeric_limits<float>::infinity();
};

/** Finds pixels that stay: with findCameraFixedPart(), or where most of the image stays, the
 *  surroundings of a camera that stands still.
 *  Looks at `num_samples` frames, evenly distributed. */
StayingPixels
findStayingPixels(const RGBDDataset& dataset, int num_threads, std::size_t num_samples = 24);

} // namespace bundle_icp
