// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/frame_cells.h"

#include "common/parallel.h"
#include "refinement/spread.h"

#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Frames are looked at in cells of so many pixels. */
constexpr int CELL = 4;
/** Depth is the same within so many standard deviations of the sensor. */
constexpr double SAME_SIGMAS = 4;

} // namespace

FrameCells
inCells(const RGBDFrame& frame)
{
  const cv::Size size(frame.depth.cols / CELL, frame.depth.rows / CELL);
  FrameCells sample;
  cv::Mat color;
  cv::resize(frame.depth, sample.depth, size, 0, 0, cv::INTER_NEAREST);
  cv::resize(frame.color, sample.color, size * 2, 0, 0, cv::INTER_AREA);
  cv::resize(frame.color, color, size, 0, 0, cv::INTER_AREA);
  cv::cvtColor(color, sample.gray, cv::COLOR_BGR2GRAY);
  sample.gray.convertTo(sample.gray, CV_32F);
  return sample;
}

std::vector<FrameCells>
readCells(const RGBDDataset& dataset, int num_threads, std::size_t num_samples)
{
  const std::size_t count = std::min(num_samples, dataset.size());
  std::vector<FrameCells> samples(count);
  parallelFor(count, num_threads, {}, [&](std::size_t k) {
    try {
      samples[k] = inCells(dataset.read(k * dataset.size() / count));
    }
    catch (const pcl::IOException&) { // the frame's own report says so
    }
  });
  samples.erase(std::remove_if(samples.begin(), samples.end(),
                               [](const FrameCells& sample) { return sample.depth.empty(); }),
                samples.end());
  return samples;
}

bool
isSameDepth(float a, float b, const DepthNoise& noise)
{
  return std::abs(a - b) <= SAME_SIGMAS * std::sqrt(2.0) * noise.sigma(std::max(a, b));
}

float
brightness(const cv::Mat& gray, const cv::Mat& reference)
{
  std::vector<double> ratios;
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x)
      if (reference.at<float>(y, x) > 0)
        ratios.push_back(gray.at<float>(y, x) / reference.at<float>(y, x));
  const double gain = medianOf(std::move(ratios));
  return gain > 0 ? float(gain) : 1;
}

cv::Mat
square(int side)
{
  return cv::getStructuringElement(cv::MORPH_RECT, {side, side});
}

} // namespace bundle_icp
