// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** Depth image reduced by an integer factor. Each pixel is the average of those pixels of its block
 *  that lie on the surface of the block's median. NaN when these are less than half of the block,
 *  or when the average is not a distance that can have been measured.
 *  \throws pcl::BadArgumentException as makeDepthView() does. */
cv::Mat
reduceDepth(const cv::Mat& depth, const CameraIntrinsics& camera, int factor,
            const VirtualDepthOptions& options);

} // namespace bundle_icp
