// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <opencv2/core.hpp>

#include <limits>

namespace bundle_icp {

/** Leaves pixels out of all steps: what has no depth gives no feature, no evidence for a pose and
 *  no surface. The image gets pixels of its own: others may hold the old ones.
 *  \param mask CV_8UC1 of the size of `depth`, not 0 = left out
 *  \param depth CV_32FC1 [m] */
inline void
leaveOut(const cv::Mat& mask, cv::Mat& depth)
{
  depth = depth.clone();
  depth.setTo(std::numeric_limits<float>::quiet_NaN(), mask);
}

} // namespace bundle_icp
