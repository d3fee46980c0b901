// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "frame_fusion.h"
#include "variants.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

std::size_t
at(int u, int v)
{
  return std::size_t(v * smallCamera().width + u);
}

/** Cosine between the ray of a pixel and a plane's normal. */
double
cosine(int u, int v, const Eigen::Vector3d& normal)
{
  const Eigen::Vector3d ray = smallCamera().unproject(u, v, 1);
  return std::abs(ray.dot(normal)) / ray.norm() / normal.norm();
}

/** Left of column 160 a wall at 1 m, right of it one at 2 m. */
RGBDFrame
step()
{
  RGBDFrame frame = flatFrame(1);
  frame.depth.colRange(160, 320).setTo(2);
  return frame;
}

} // namespace

TEST(DepthSamples, KeepDepthsInRangeAlone)
{
  RGBDFrame frame = flatFrame(1);
  const float bad[] = {0, -1, NAN, INFINITY, -INFINITY, 0.0999f, 5.001f};
  for (int i = 0; i < 7; ++i)
    frame.depth.at<float>(100, 20 * i + 20) = bad[i];
  const DepthSamples samples = samplesOf(frame);
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(samples.depth[at(20 * i + 20, 100)], 0) << bad[i];
    EXPECT_EQ(samples.weight[at(20 * i + 20, 100)], 0) << bad[i];
    EXPECT_EQ(samples.depth[at(20 * i + 21, 100)], 1);
  }
  for (const float limit : {0.1f, 5.0f})
    EXPECT_EQ(samplesOf(flatFrame(limit)).depth[at(7, 7)], limit);
}

TEST(DepthSamples, WeighFrontalMeasurementsByNoiseAndRay)
{
  const DepthNoise noise = smallCamera().depth_noise;
  forEachVariant([&] {
    for (const float z : {0.4f, 1.0f, 2.5f, 4.9f}) {
      const DepthSamples samples = samplesOf(flatFrame(z));
      const double best = std::pow(noise.sigma(1) / noise.sigma(z), 2);
      for (const auto& [u, v] : {std::make_pair(160, 120), {20, 30}, {300, 200}, {1, 238}})
        EXPECT_NEAR(samples.weight[at(u, v)] / (best * cosine(u, v, {0, 0, 1})), 1, 1e-3);
    }
  });
}

TEST(DepthSamples, WeighSlantedMeasurementsByTheirCosine)
{
  const DepthNoise noise = smallCamera().depth_noise;
  for (const Eigen::Vector3d& normal :
       {Eigen::Vector3d(0.5, 0, 1), Eigen::Vector3d(0, -1, 1), Eigen::Vector3d(1.2, 0.7, 1)}) {
    const RGBDFrame frame = render(plane(normal, 1.2), Pose::Identity());
    const DepthSamples samples = samplesOf(frame);
    for (const auto& [u, v] : {std::make_pair(160, 120), {140, 100}, {180, 130}}) {
      const double z = frame.depth.at<float>(v, u);
      const double expected = std::pow(noise.sigma(1) / noise.sigma(z), 2) * cosine(u, v, normal);
      EXPECT_NEAR(samples.weight[at(u, v)] / expected, 1, 0.01) << normal.transpose();
    }
  }
}

TEST(DepthSamples, NextToEdgesFewerNeighboursVote)
{
  const DepthSamples inside = samplesOf(flatFrame(1)), edge = samplesOf(step());
  const auto share = [&](int u, int v) { return edge.weight[at(u, v)] / inside.weight[at(u, v)]; };
  EXPECT_FLOAT_EQ(share(157, 120), 1);
  EXPECT_NEAR(share(159, 120), std::pow(5 / 8.0, 2), 1e-3); // 5 of 8
  // At the image's border the neighbours outside do not vote either.
  EXPECT_NEAR(inside.weight[at(160, 0)] / cosine(160, 0, {0, 0, 1}), std::pow(5 / 8.0, 2), 1e-3);
  EXPECT_NEAR(inside.weight[at(0, 0)] / cosine(0, 0, {0, 0, 1}), std::pow(3 / 8.0, 2), 1e-3);
}

TEST(DepthSamples, FlyingPixelsDoNotCount)
{
  RGBDFrame frame = step();
  frame.depth.at<float>(50, 160) = 1.5f;             // alone
  frame.depth(cv::Rect(160, 100, 1, 9)).setTo(1.5f); // a line: two neighbours at most
  frame.depth(cv::Rect(160, 150, 3, 3)).setTo(1.5f); // something small: three in its corners
  const DepthSamples samples = samplesOf(frame);
  EXPECT_EQ(samples.weight[at(160, 50)], 0);
  for (int v = 100; v < 109; ++v)
    EXPECT_EQ(samples.weight[at(160, v)], 0) << v;
  for (int i = 0; i < 9; ++i)
    EXPECT_GT(samples.weight[at(160 + i % 3, 150 + i / 3)], 0) << i;
  EXPECT_EQ(samples.depth[at(160, 50)], 1.5f); // known, but not used
}

TEST(DepthSamples, ColorsCountTwoPixelsFromEdges)
{
  const DepthSamples samples = samplesOf(step());
  for (int u = 150; u < 170; ++u) {
    const std::uint32_t color = samples.color[at(u, 120)];
    EXPECT_EQ(color & 0xffffffu, 50u | 100u << 8 | 150u << 16);
    EXPECT_EQ(color >> QUALITY_SHIFT, u < 158 || u > 161 ? BEST_QUALITY : 1u) << u;
  }
  RGBDFrame colorless = step();
  colorless.color.release();
  EXPECT_TRUE(samplesOf(colorless).color.empty());
}

TEST(DepthSamples, RangesAreThoseOfTheTiles)
{
  // Tiles do not divide these images.
  CameraIntrinsics camera = smallCamera();
  camera.width = 123;
  camera.height = 77;
  camera.cx = 61;
  camera.cy = 38;
  RGBDFrame frame;
  frame.depth.create(camera.height, camera.width, CV_32FC1);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-3, 7); // many of them out of range
  for (auto z = frame.depth.begin<float>(); z != frame.depth.end<float>(); ++z)
    *z = uniform(random);
  frame.depth(cv::Rect(16, 8, 8, 8)).setTo(NAN);
  const DepthSamples samples(frame, camera, coarseOptions(), 0.001, 2);
  EXPECT_EQ(samples.tiles_x, 16);
  EXPECT_EQ(samples.tiles_y, 10);
  std::vector<Eigen::Vector2f> expected(160, {INFINITY, 0});
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      if (const float z = frame.depth.at<float>(v, u); z >= 0.1f && z <= 5) {
        Eigen::Vector2f& range = expected[v / 8 * 16 + u / 8];
        range = {std::min(range.x(), z), std::max(range.y(), z)};
      }
  EXPECT_EQ(samples.depth_range, expected);
  EXPECT_EQ(samples.depth_range[18], Eigen::Vector2f(INFINITY, 0));
}

TEST(DepthSamples, AreTheSameForAnyThreadsAndVariant)
{
  RGBDFrame frame = render(sphere(0.3), lookAt({0, 0.2, -1}, {0, 0, 0}));
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 0.002f);
  for (auto z = frame.depth.begin<float>(); z != frame.depth.end<float>(); ++z)
    *z += noise(random);
  const DepthSamples expected = samplesOf(frame);
  forEachVariant([&] {
    for (const int threads : {1, 3}) {
      const DepthSamples samples = samplesOf(frame, coarseOptions(), threads);
      EXPECT_EQ(samples.weight, expected.weight);
      EXPECT_EQ(samples.color, expected.color);
      EXPECT_EQ(samples.depth_range, expected.depth_range);
    }
  });
}
