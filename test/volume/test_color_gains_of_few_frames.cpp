// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/color_gains.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace bundle_icp;

// Cases of so few frames that the least squares have a solution on paper.
namespace {

/** Without weights against outliers: they begin with the second iteration. */
ColorGainOptions
once()
{
  ColorGainOptions options;
  options.iterations = 1;
  return options;
}

std::vector<ColorObservation>
pairs(std::size_t points, const cv::Vec3b& first, const cv::Vec3b& second)
{
  std::vector<ColorObservation> observations;
  for (std::size_t point = 0; point < points; ++point) {
    observations.push_back({0, point, first});
    observations.push_back({1, point, second});
  }
  return observations;
}

/** The logarithm of the factor between two frames that see N points with the ratio of colours r:
 *  N / c^2 (d + log r)^2 / 2 + d^2 / (2 g^2) is least. */
double
factorOfTwo(double points, double ratio, const ColorGainOptions& options)
{
  const double evidence = points / std::pow(options.color_sigma, 2);
  return -std::log(ratio) * evidence / (evidence + 1 / std::pow(options.gain_sigma, 2));
}

} // namespace

TEST(ColorGainsOfFewFrames, TwoFramesMeetHalfway)
{
  for (const std::size_t points : {1u, 4u, 100u})
    for (const double gain_sigma : {0.01, 0.3, 1.0}) {
      ColorGainOptions options = once();
      options.gain_sigma = gain_sigma;
      const auto gains =
          estimateColorGains(pairs(points, {100, 50, 80}, {150, 100, 40}), 2, options);
      const double ratios[] = {1.5, 2, 0.5};
      for (int channel = 0; channel < 3; ++channel) {
        const double factor = factorOfTwo(double(points), ratios[channel], options);
        EXPECT_NEAR(std::log(gains[1][channel]), factor / 2, 1e-5);
        EXPECT_NEAR(std::log(gains[0][channel]), -factor / 2, 1e-5);
      }
    }
}

TEST(ColorGainsOfFewFrames, MoreEvidenceOutweighsThePrior)
{
  double worst = INFINITY;
  for (const std::size_t points : {1u, 10u, 1000u}) {
    const auto gains =
        estimateColorGains(pairs(points, {100, 100, 100}, {120, 120, 120}), 2, once());
    const double left = std::abs(std::log(120 * gains[1][0] / (100 * gains[0][0])));
    EXPECT_LT(left, 0.3 * worst);
    worst = left;
  }
  EXPECT_LT(worst, 1e-4);
}

TEST(ColorGainsOfFewFrames, ChannelsClipEachByThemselves)
{
  // Blue is too dark in the first frame, red too bright in the second; green says 2.
  const auto gains = estimateColorGains(pairs(10, {9, 60, 200}, {60, 120, 246}), 2, once());
  for (const Eigen::Vector3f& gain : gains) {
    EXPECT_EQ(gain[0], 1);
    EXPECT_EQ(gain[2], 1);
  }
  EXPECT_NEAR(std::log(gains[1][1] / gains[0][1]), factorOfTwo(10, 2, once()), 1e-5);
  // The darkest and the brightest that count
  const auto ends = estimateColorGains(pairs(10, {10, 10, 10}, {245, 245, 245}), 2, once());
  EXPECT_NEAR(std::log(ends[1][0] / ends[0][0]), factorOfTwo(10, 24.5, once()), 1e-5);
}

TEST(ColorGainsOfFewFrames, WhatAgreesStays)
{
  const auto gains = estimateColorGains(pairs(20, {100, 50, 200}, {100, 50, 200}), 2);
  for (const Eigen::Vector3f& gain : gains)
    EXPECT_TRUE(gain.isApprox(Eigen::Vector3f::Ones(), 1e-6f));
}

TEST(ColorGainsOfFewFrames, AChainOfFramesIsLinkedThroughTheMiddle)
{
  // Frames 0 and 2 share nothing; frame 3 shares nothing with any.
  std::vector<ColorObservation> chain;
  for (std::size_t point = 0; point < 2000; ++point) {
    const std::size_t first = point % 2;
    chain.push_back({first, point, cv::Vec3b::all(first == 0 ? 60 : 90)});
    chain.push_back({first + 1, point, cv::Vec3b::all(first == 0 ? 90 : 180)});
  }
  chain.push_back({3, 5000, cv::Vec3b::all(100)});
  const auto gains = estimateColorGains(chain, 4);
  EXPECT_NEAR(gains[0][0] * 60, gains[1][0] * 90, 0.5);
  EXPECT_NEAR(gains[1][0] * 90, gains[2][0] * 180, 0.5);
  EXPECT_EQ(gains[3], Eigen::Vector3f::Ones());
}

TEST(ColorGainsOfFewFrames, AnOutlierPullsLessThanWithoutWeights)
{
  std::vector<ColorObservation> observations = pairs(20, {100, 100, 100}, {100, 100, 100});
  for (std::size_t i = 0; i < 5; ++i)
    observations[2 * i].color = {20, 20, 20};
  ColorGainOptions options = once();
  const double unweighted = estimateColorGains(observations, 2, options)[0][0];
  options.iterations = 10;
  const double weighted = estimateColorGains(observations, 2, options)[0][0];
  EXPECT_GT(unweighted, 1.15);
  EXPECT_NEAR(weighted, 1, 0.03);
}

TEST(ColorGainsOfFewFrames, PointsThatManyFramesSeeTellOfAllOfThem)
{
  // Of so many frames of a point only some count; no frame may be left out of all points.
  std::vector<ColorObservation> observations;
  constexpr std::size_t frames = 100;
  for (std::size_t point = 0; point < 500; ++point)
    for (std::size_t frame = 0; frame < frames; ++frame)
      if ((frame + 7 * point) % 3 != 0)
        observations.push_back({frame, point, cv::Vec3b::all(frame % 2 ? 120 : 100)});
  const auto gains = estimateColorGains(observations, frames);
  const float odd = gains[1][0], even = gains[0][0];
  EXPECT_NEAR(odd / even, 100.0 / 120, 0.005);
  for (std::size_t frame = 0; frame < frames; ++frame)
    EXPECT_NEAR(gains[frame][0], frame % 2 ? odd : even, 0.01) << frame;
}
