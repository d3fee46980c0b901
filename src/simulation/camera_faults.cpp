// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/camera_faults.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace bundle_icp {
namespace simulation {
namespace {

enum Purpose : std::uint64_t { BLUR, SHAKE, EXPOSURE, COLOR_NOISE, FLYING, DEPTH_NOISE, HOLES };

constexpr double NEAREST_MEASURED = 0.4, FARTHEST_MEASURED = 5;
const float not_measured = std::numeric_limits<float>::quiet_NaN();

/** Gaussian noise of unit variance at every pixel, half of it shared by neighbours.
 * CV_32FC1. */
cv::Mat
correlatedNoise(const cv::Size& size, cv::RNG& random)
{
  constexpr int margin = 2; // where the interpolation repeats the border
  const cv::Size grid((size.width + 1) / 2 + margin, (size.height + 1) / 2 + margin);
  cv::Mat nodes(grid, CV_32FC1), coarse, fine(size, CV_32FC1);
  random.fill(nodes, cv::RNG::NORMAL, 0, 1);
  random.fill(fine, cv::RNG::NORMAL, 0, 1);
  cv::resize(nodes, coarse, grid * 2, 0, 0, cv::INTER_LINEAR);
  // Doubling interpolates with weights 1/4 and 3/4 in both directions at every pixel.
  const double coarse_deviation = 0.625;
  const double share = std::sqrt(0.5);
  cv::Mat noise;
  cv::addWeighted(coarse(cv::Rect({margin, margin}, size)), share / coarse_deviation, fine, share,
                  0, noise);
  return noise;
}

void
addFlyingPixels(cv::Mat& depth, cv::RNG random)
{
  cv::Mat nearest, farthest;
  cv::erode(depth, nearest, cv::Mat());
  cv::dilate(depth, farthest, cv::Mat());
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const float front = nearest.at<float>(y, x), back = farthest.at<float>(y, x);
      // A surface seen at a grazing angle changes less than that from pixel to pixel.
      if (back - front < 0.03f + 0.04f * front)
        continue;
      const float share = random.uniform(-1.f, 1.f);
      if (share > 0)
        depth.at<float>(y, x) = front + share * (back - front);
    }
}

/** Takes away `fraction` of the pixels, where coarse noise and lack of reflection add
 * up. */
void
cutHoles(cv::Mat& depth, const cv::Mat& reflection, double fraction, cv::RNG random)
{
  cv::Mat score;
  for (const int patch : {40, 12}) {
    cv::Mat nodes(depth.rows / patch + 3, depth.cols / patch + 3, CV_32FC1), smooth;
    random.fill(nodes, cv::RNG::NORMAL, 0, 1);
    cv::resize(nodes, smooth, depth.size(), 0, 0, cv::INTER_CUBIC);
    score = score.empty() ? smooth : cv::Mat(score + 0.6 * smooth);
  }
  score -= 2.5 * reflection;
  std::vector<float> sorted;
  sorted.reserve(depth.total());
  for (int y = 0; y < depth.rows; ++y)
    sorted.insert(sorted.end(), score.ptr<float>(y), score.ptr<float>(y) + depth.cols);
  const auto rank = sorted.begin() + std::ptrdiff_t((1 - fraction) * double(sorted.size()));
  if (rank == sorted.end())
    return;
  std::nth_element(sorted.begin(), rank, sorted.end());
  depth.setTo(not_measured, score >= double(*rank));
}

} // namespace

cv::RNG
frameRandom(std::uint64_t seed, std::size_t frame, std::uint64_t purpose)
{
  // Splitmix after each number: neighbouring frames and seeds are unrelated.
  std::uint64_t state = seed;
  for (const std::uint64_t number : {std::uint64_t(frame), purpose}) {
    state += 0x9e3779b97f4a7c15u * (number + 1);
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
    state = (state ^ (state >> 27)) * 0x94d049bb133111ebu;
    state ^= state >> 31;
  }
  return cv::RNG(state);
}

bool
drawBlurred(const SyntheticScanOptions& options, std::size_t frame)
{
  return frameRandom(options.seed, frame, BLUR).uniform(0.0, 1.0) < options.blur_fraction;
}

std::vector<Pose>
drawShake(const SyntheticScanOptions& options, std::size_t frame)
{
  constexpr int num_poses = 10;
  cv::RNG random = frameRandom(options.seed, frame, SHAKE);
  const double angle = random.uniform(0.02, 0.04); // 10 to 20 px at a focal length of 500
  const double direction = random.uniform(0.0, 2 * CV_PI);
  Vector6d motion;
  motion << angle * std::cos(direction), angle * std::sin(direction), 0, 0, 0, 0;
  for (int i = 2; i < 6; ++i)
    motion[i] = random.uniform(-0.006, 0.006);
  std::vector<Pose> poses;
  for (int i = 0; i < num_poses; ++i)
    poses.push_back(increment(motion * ((i + 0.5) / num_poses - 0.5)));
  return poses;
}

void
spoilColor(cv::Mat& color, const SyntheticScanOptions& options, std::size_t frame, double time)
{
  cv::Mat noise(color.size(), CV_32FC3, cv::Scalar::all(0));
  if (options.color_noise > 0)
    frameRandom(options.seed, frame, COLOR_NOISE)
        .fill(noise, cv::RNG::NORMAL, 0, options.color_noise);
  const double phase = frameRandom(options.seed, 0, EXPOSURE).uniform(0.0, 2 * CV_PI);
  const double gain = 1 + options.exposure_change * std::sin(2 * CV_PI * time / 9.0 + phase);
  cv::addWeighted(color, gain, noise, 1, 0, color, CV_8UC3);
}

void
spoilDepth(cv::Mat& depth, const cv::Mat& reflection, const SyntheticScanOptions& options,
           std::size_t frame)
{
  if (options.flying_pixels)
    addFlyingPixels(depth, frameRandom(options.seed, frame, FLYING));
  const bool is_noisy = options.noise_factor > 0;
  cv::Mat noise = cv::Mat::zeros(depth.size(), CV_32FC1);
  if (is_noisy) {
    cv::RNG random = frameRandom(options.seed, frame, DEPTH_NOISE);
    noise = correlatedNoise(depth.size(), random);
  }
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      float& measured = depth.at<float>(y, x);
      double z = measured * (1 + options.depth_bias * measured);
      if (is_noisy)
        z += options.noise_factor * options.noise.sigma(z) * noise.at<float>(y, x);
      if (options.quantisation > 0) // equal steps of disparity
        z = 1 / (options.quantisation * std::max(1.0, std::round(1 / (options.quantisation * z))));
      const bool is_out_of_range = z < NEAREST_MEASURED || z > FARTHEST_MEASURED;
      measured = is_noisy && is_out_of_range ? not_measured : float(z);
    }
  if (options.hole_fraction > 0)
    cutHoles(depth, reflection, options.hole_fraction, frameRandom(options.seed, frame, HOLES));
}

} // namespace simulation
} // namespace bundle_icp
