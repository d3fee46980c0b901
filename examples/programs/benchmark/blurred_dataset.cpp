// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "blurred_dataset.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace bundle_icp {
namespace {

constexpr double SHORTEST = 0.02, LONGEST = 0.06; ///< of the image's width

/** A line through the centre, as weights that sum to 1. */
cv::Mat
blurKernel(double length, double angle)
{
  const int half = int(std::ceil(length / 2)) + 1;
  cv::Mat kernel = cv::Mat::zeros(2 * half + 1, 2 * half + 1, CV_32F);
  const int steps = int(8 * length);
  for (int i = 0; i <= steps; ++i) {
    const double along = length * (double(i) / steps - 0.5);
    const double x = half + along * std::cos(angle), y = half + along * std::sin(angle);
    kernel.at<float>(int(std::lround(y)), int(std::lround(x))) += 1;
  }
  return kernel / cv::sum(kernel)[0];
}

} // namespace

BlurredDataset::BlurredDataset(RGBDDataset::Ptr sharp, double fraction, std::uint64_t seed)
: sharp_(std::move(sharp)), seed_(seed), is_blurred_(sharp_->size())
{
  std::vector<std::size_t> order(size());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
  const auto count = std::size_t(std::lround(fraction * double(size())));
  for (std::size_t k = 0; k < count; ++k)
    is_blurred_[order[k]] = 1;
}

RGBDFrame
BlurredDataset::read(std::size_t index) const
{
  RGBDFrame frame = sharp_->read(index);
  if (!isBlurred(index))
    return frame;
  std::mt19937_64 random(seed_ + 0x9e3779b97f4a7c15ull * (id(index) + 1));
  std::uniform_real_distribution<double> uniform(0, 1);
  const double length = frame.color.cols * (SHORTEST + (LONGEST - SHORTEST) * uniform(random));
  cv::Mat blurred;
  cv::filter2D(frame.color, blurred, -1, blurKernel(length, CV_PI * uniform(random)),
               cv::Point(-1, -1), 0, cv::BORDER_REPLICATE);
  frame.color = blurred;
  return frame;
}

} // namespace bundle_icp
