// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/depth_numbers.h"

#include <bundle_icp/common/rgbd_frame.h>

namespace bundle_icp {

/** Width of the images of edges [px]: a pixel of them forgives a registration of a few pixels. */
constexpr int EDGE_WIDTH = 160;

/** What checkRecording() keeps of a frame. */
struct FrameLook {
  bool is_read = false;
  double brightness = 0;   ///< mean grey level of 255
  double contrast = 0;     ///< standard deviation of the grey levels of 255
  double sharpness = 0;    ///< mean square of the differences of neighbours, over the contrast's
  double measured = 0;     ///< share of the pixels that have depth
  double median_depth = 0; ///< [m]; 0 without depth
  double near_depth = 0;   ///< a tenth of the depth is nearer [m]; 0 without depth
  double far_depth = 0;    ///< a tenth of the depth is farther [m]; 0 without depth
  DepthNumbers numbers;
  cv::Mat depth_edges; ///< CV_32FC1, small: where the depth jumps, mean 0, norm 1 or empty
  cv::Mat color_edges; ///< CV_32FC1, of the same size, mean 0, norm 1 or empty
  cv::Mat small_grey;  ///< CV_32FC1, of the same size
  std::uint64_t color_hash = 0, depth_hash = 0; ///< of all bytes
};

FrameLook
lookAt(const RGBDFrame& frame, const CameraIntrinsics& camera);

/** Mean 0 and norm 1; empty when nothing differs. */
cv::Mat
normalised(const cv::Mat& image);

/** How well depth edges, moved by `shift`, lie on colour edges, -1 to 1; 0 when either is empty. */
double
agreement(const FrameLook& depth, const FrameLook& color, const cv::Point& shift = {});

} // namespace bundle_icp
