// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/frame_resampler.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <limits>

namespace bundle_icp {

FrameResampler::FrameResampler(const CameraIntrinsics& from, const CameraIntrinsics& to)
: depth_x_(to.height, to.width, CV_32FC1), depth_y_(to.height, to.width, CV_32FC1)
{
  for (int v = 0; v < to.height; ++v)
    for (int u = 0; u < to.width; ++u) {
      const Eigen::Vector2d pixel = from.project(to.unproject(u, v, 1));
      depth_x_.at<float>(v, u) = float(pixel.x());
      depth_y_.at<float>(v, u) = float(pixel.y());
    }
  const double reduction = std::max(1.0, std::min(from.fx / to.fx, from.fy / to.fy));
  color_size_ = cv::Size(cvRound(from.width / reduction), cvRound(from.height / reduction));
  // Centres of pixels lie at whole numbers.
  const double x = double(color_size_.width) / from.width;
  const double y = double(color_size_.height) / from.height;
  depth_x_.convertTo(color_x_, CV_32F, x, 0.5 * x - 0.5);
  depth_y_.convertTo(color_y_, CV_32F, y, 0.5 * y - 0.5);
}

RGBDFrame
FrameResampler::operator()(const RGBDFrame& frame) const
{
  RGBDFrame resampled{frame.id, frame.timestamp, {}, {}};
  cv::remap(frame.depth, resampled.depth, depth_x_, depth_y_, cv::INTER_NEAREST,
            cv::BORDER_CONSTANT, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  cv::Mat color = frame.color;
  if (color.size() != color_size_)
    cv::resize(frame.color, color, color_size_, 0, 0, cv::INTER_AREA);
  cv::remap(color, resampled.color, color_x_, color_y_, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return resampled;
}

} // namespace bundle_icp
