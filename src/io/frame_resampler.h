// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** Gives the frames of a camera as another camera of the same pose would have taken them. What only
 *  one of the two sees is black and has no depth. */
class FrameResampler {
public:
  /** Cameras without distortion. */
  FrameResampler(const CameraIntrinsics& from, const CameraIntrinsics& to);

  RGBDFrame
  operator()(const RGBDFrame& frame) const;

private:
  /** CV_32FC1: where each pixel of the other camera lies in the depth image [px]. */
  cv::Mat depth_x_, depth_y_;
  cv::Size
      color_size_; ///< that colour gets first, by averages, where the other's pixels are larger
  cv::Mat color_x_, color_y_; ///< the same in the colour image of that size [px]
};

} // namespace bundle_icp
