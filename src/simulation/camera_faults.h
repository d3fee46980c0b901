// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <opencv2/core.hpp>
#include <vector>

namespace bundle_icp {
namespace simulation {

/** Random numbers of one frame for one purpose, independent of all others. */
cv::RNG
frameRandom(std::uint64_t seed, std::size_t frame, std::uint64_t purpose);

/** True when the frame is to be motion blurred. */
bool
drawBlurred(const SyntheticScanOptions& options, std::size_t frame);

/** Motions of the camera within one exposure, relative to its middle; their mean is
 * none. */
std::vector<Pose>
drawShake(const SyntheticScanOptions& options, std::size_t frame);

/** Changes exposure and adds noise to a colour image (CV_8UC3). */
void
spoilColor(cv::Mat& color, const SyntheticScanOptions& options, std::size_t frame, double time);

/** Turns exact depth into measured depth: flying pixels, bias, noise, quantisation, holes, range,
 *  in this order.
 *  \param[in,out] depth CV_32FC1 [m]
 *  \param[in] reflection CV_32FC1, 0 to 1: share of the camera's light that the surface reflects */
void
spoilDepth(cv::Mat& depth, const cv::Mat& reflection, const SyntheticScanOptions& options,
           std::size_t frame);

} // namespace simulation
} // namespace bundle_icp
