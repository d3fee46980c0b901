// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** One frame of the scan: a colour and a depth image of the same size, registered to each other, of
 *  an ideal pinhole camera (the reader removes distortion). */
struct RGBDFrame {
  std::size_t id = 0;   ///< number of the frame in the recording, unique; gaps are allowed
  double timestamp = 0; ///< [s]
  cv::Mat color;        ///< CV_8UC3, BGR
  cv::Mat depth;        ///< CV_32FC1, metres along the optical axis, NaN = not measured
};

} // namespace bundle_icp
