// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <opencv2/core.hpp>

namespace bundle_icp {

/** Mask of pixels whose depth differs from that of all neighbours by a tenth or more: noise of the
 *  sensor or of a transmission, for no surface is so small. Pixels with few measured neighbours are
 *  not among them.
 *  \param depth CV_32FC1 [m], NaN = not measured
 *  \return CV_8UC1, 255 = alone */
cv::Mat
loneDepth(const cv::Mat& depth);

} // namespace bundle_icp
