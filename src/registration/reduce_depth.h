// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "depth_edges.h"

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** Depth image reduced by an integer factor: each pixel is the average of those of its
 * block that lie on the surface of their median, NaN when that is less than half of
 * them. */
cv::Mat
reducedDepth(const cv::Mat& depth, int factor, const SurfaceLink& linked, int threads);

} // namespace bundle_icp
