// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/finding.h>

#include <opencv2/core.hpp>
#include <vector>

namespace bundle_icp {

/** What the numbers of a depth image look like, whatever they measure. */
struct DepthNumbers {
  bool has_depth = false;
  double step = 0;        ///< between one value and the next larger one, median over the pixels [m]
  double step_sigmas = 0; ///< the same in standard deviations of the sensor's noise
  double largest = 0;     ///< largest value [m]
  double at_most = 0;     ///< share of the pixels that have it
  double alone = 0;       ///< share of the measured pixels that loneDepth() finds
  /** Of patches that are flat: how much the numbers are lengths of rays (1) and not depth along the
   *  optical axis (0). The inverse depth of a plane is linear in the pixel, that of rays is not. */
  std::vector<double> ray_shares;
  /** Of patches with a slope: logarithm of the deviation from a plane if the numbers are inverse
   *  depth (disparity), over that if they are depth. Above 0 for depth. */
  std::vector<double> inverse_ratios;
};

/** \param depth CV_32FC1 [m], NaN = not measured */
DepthNumbers
numbersOf(const cv::Mat& depth, const CameraIntrinsics& camera);

/** Numbers that are no depth, or no longer: in steps, clipped, noise, inverse, along rays.
 *  \param frames the numbers of some frames
 *  \param share_of_views of these frames, that show different views: others witness nothing new */
void
checkNumbers(const std::vector<DepthNumbers>& frames, double share_of_views,
             std::vector<Finding>& findings);

} // namespace bundle_icp
