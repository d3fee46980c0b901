// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/depth_noise.h>

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** Number of smoothDepth()'s passes. */
int
smoothingPasses(int radius);

/** Averages each depth with the surrounding depths of its surface: an edge-avoiding a-trous filter
 *  (Dammertz et al., HPG 2010), passes of 5x5 taps whose spacing doubles, on the inverse of depth.
 *  On inverse depth a plane is linear, so a symmetric window does not move it at any slant, and
 *  noise that grows with the square of depth is nearly constant. Pixels without depth stay without.
 *  \param depth CV_32FC1 [m], NaN = not measured
 *  \param radius half size of the window [px]; as many passes as reach it: 2, 6 or 14 pixels */
cv::Mat
smoothDepth(const cv::Mat& depth, const DepthNoise& noise, int radius, int num_threads);

} // namespace bundle_icp
