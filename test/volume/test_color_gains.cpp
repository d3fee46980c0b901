// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "volume/color_gains.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <algorithm>
#include <random>

using namespace bundle_icp;

namespace {

// 40 frames; each sees 60 points, of which it shares most with its neighbours along the scan.
constexpr std::size_t num_frames = 40;

Eigen::Vector3d
trueGain(std::size_t frame)
{
  // Exposure and white balance that come and go
  const double t = double(frame);
  return {1 + 0.25 * std::sin(0.4 * t), 1 + 0.2 * std::sin(0.4 * t + 0.3),
          1 + 0.15 * std::cos(0.25 * t)};
}

std::vector<ColorObservation>
observe(double noise, double outliers = 0)
{
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<cv::Vec3d> colors(800);
  for (cv::Vec3d& color : colors)
    color = {40 + 120 * uniform(random), 40 + 120 * uniform(random), 40 + 120 * uniform(random)};
  std::vector<ColorObservation> observations;
  for (std::size_t frame = 0; frame < num_frames; ++frame)
    for (std::size_t i = 0; i < 60; ++i) {
      ColorObservation observation{frame, 15 * frame + i, {}};
      const bool is_outlier = uniform(random) < outliers;
      for (int channel = 0; channel < 3; ++channel)
        observation.color[channel] = cv::saturate_cast<std::uint8_t>(
            is_outlier
                ? 255 * uniform(random)
                : colors[observation.point][channel] * trueGain(frame)[channel] + normal(random));
      observations.push_back(observation);
    }
  return observations;
}

// Largest deviation of gain * true gain, which one factor for all frames leaves open.
double
worstError(const std::vector<Eigen::Vector3f>& gains)
{
  double worst = 0;
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<double> logs;
    double mean = 0;
    for (std::size_t frame = 0; frame < num_frames; ++frame) {
      logs.push_back(std::log(gains[frame][channel] * trueGain(frame)[channel]));
      mean += logs.back() / num_frames;
    }
    for (const double value : logs)
      worst = std::max(worst, std::abs(value - mean));
  }
  return worst;
}

} // namespace

TEST(ColorGains, MakeFramesAgree)
{
  EXPECT_GT(worstError(std::vector<Eigen::Vector3f>(num_frames, Eigen::Vector3f::Ones())), 0.2);
  // What is left: rounding to whole grey levels, and the pull of gain_sigma.
  EXPECT_LT(worstError(estimateColorGains(observe(0), num_frames)), 0.015);
}

TEST(ColorGains, DoNotDriftAlongTheScanUnderNoiseAndOutliers)
{
  EXPECT_LT(worstError(estimateColorGains(observe(4), num_frames)), 0.04);
  EXPECT_LT(worstError(estimateColorGains(observe(4, 0.15), num_frames)), 0.06);
}

TEST(ColorGains, DoNotDependOnTheOrderOfObservations)
{
  std::vector<ColorObservation> observations = observe(4);
  const auto gains = estimateColorGains(observations, num_frames);
  std::shuffle(observations.begin(), observations.end(), std::mt19937(5));
  const auto shuffled = estimateColorGains(observations, num_frames);
  for (std::size_t frame = 0; frame < num_frames; ++frame)
    EXPECT_TRUE(gains[frame].isApprox(shuffled[frame], 1e-5f));
}

TEST(ColorGains, AreOneWithoutEvidence)
{
  EXPECT_TRUE(estimateColorGains({}, 0).empty());
  // Points that one frame alone sees, and clipped colours, say nothing.
  const std::vector<ColorObservation> nothing{
      {0, 1, {100, 100, 100}}, {1, 2, {200, 200, 200}}, {0, 3, {255, 255, 255}}, {1, 3, {5, 5, 5}}};
  for (const Eigen::Vector3f& gain : estimateColorGains(nothing, 3))
    EXPECT_EQ(gain, Eigen::Vector3f::Ones());
}

TEST(ColorGains, RefuseBadArguments)
{
  const auto refusal = [](const ColorGainOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { estimateColorGains({}, 1, options); });
  };
  ColorGainOptions options;
  options.color_sigma = 0;
  EXPECT_CONTAINS(refusal(options), "color_sigma must lie in 0.001 ... 1");
  options = {};
  options.gain_sigma = NAN;
  EXPECT_CONTAINS(refusal(options), "gain_sigma must lie in");
  options = {};
  options.iterations = 0;
  EXPECT_CONTAINS(refusal(options), "iterations must lie in 1 ... 100");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] {
                    estimateColorGains({{5, 0, {}}}, 5);
                  }),
                  "observation of frame 5 of 5");
}
