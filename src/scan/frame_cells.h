// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core.hpp>

#include <vector>

namespace bundle_icp {

/** A frame in cells of some pixels each. */
struct FrameCells {
  cv::Mat depth; ///< CV_32FC1, of one pixel of each cell [m]; NaN where it was not measured
  cv::Mat gray;  ///< CV_32FC1, mean of the cell
  cv::Mat color; ///< CV_8UC3, of twice as many pixels a side
};

/** Smallest share of the image that a region must have to count. */
constexpr double SMALLEST_REGION = 0.005;
/** A cell stays when it is the same in this share of the frames. */
constexpr double STAYS = 0.85;

FrameCells
inCells(const RGBDFrame& frame);

/** The frames that can be read, of `num_samples` that are evenly distributed. */
std::vector<FrameCells>
readCells(const RGBDDataset& dataset, int num_threads, std::size_t num_samples);

/** Whether two depths of a cell are the same, as far as the sensor can tell. */
bool
isSameDepth(float a, float b, const DepthNoise& noise);

/** Brightness of a frame as a multiple of that of `reference`, where both are known. */
float
brightness(const cv::Mat& gray, const cv::Mat& reference);

/** Structuring element of morphology. */
cv::Mat
square(int side);

} // namespace bundle_icp
