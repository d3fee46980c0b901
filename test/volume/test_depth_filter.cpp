// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "frame_fusion.h"
#include "variants.h"

#include "volume/depth_filter.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const DepthNoise NOISE;

cv::Mat
smooth(const cv::Mat& depth, int radius = 10, int num_threads = 1)
{
  return smoothDepth(depth, NOISE, radius, num_threads);
}

/** Without the pixels whose window the border cuts. */
cv::Mat
middle(const cv::Mat& image)
{
  return image(cv::Rect(14, 14, image.cols - 28, image.rows - 28));
}

/** A wall at 1 m with independent noise of so many sigmas. */
cv::Mat
noisyWall(double sigmas)
{
  cv::Mat depth = flatFrame(1).depth;
  std::mt19937 random(9);
  std::normal_distribution<float> noise(0, float(sigmas * NOISE.sigma(1)));
  for (auto z = depth.begin<float>(); z != depth.end<float>(); ++z)
    *z += noise(random);
  return depth;
}

double
deviation(const cv::Mat& image)
{
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0];
}

/** Equal, with NaN at the same pixels. */
bool
areSame(const cv::Mat& one, const cv::Mat& other)
{
  return cv::countNonZero(one == other) == cv::countNonZero(one == one) &&
         cv::countNonZero(one == one) == cv::countNonZero(other == other);
}

} // namespace

TEST(DepthFilter, TakesAsManyPassesAsReachTheRadius)
{
  const int passes[] = {0, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  for (int radius = 0; radius <= 10; ++radius)
    EXPECT_EQ(smoothingPasses(radius), passes[radius]) << radius;
  EXPECT_EQ(smoothingPasses(100), 3);
}

TEST(DepthFilter, PlanesStayAtAnySlant)
{
  for (const Eigen::Vector3d& normal :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.8, 0, 1), Eigen::Vector3d(-0.4, 1.1, 1)}) {
    const cv::Mat depth = render(plane(normal, 1.5), Pose::Identity()).depth;
    forEachVariant([&] {
      for (const int radius : {2, 6, 10})
        EXPECT_LT(cv::norm(middle(smooth(depth, radius)) / middle(depth) - 1, cv::NORM_INF), 2e-6)
            << normal.transpose() << ", radius " << radius;
    });
  }
}

TEST(DepthFilter, AveragesAsManyPixelsAsItsSplines)
{
  // Of noise far below the width of the surface, the weights are those of the B-splines: 1 over
  // the sum of their squares, by the number of passes.
  const double pixels[] = {1, 13.4, 66, 264};
  const cv::Mat depth = noisyWall(0.2);
  const double before = deviation(middle(depth));
  for (const int radius : {1, 3, 7}) {
    const double left = deviation(middle(smooth(depth, radius))) / before;
    EXPECT_NEAR(left * std::sqrt(pixels[smoothingPasses(radius)]), 1, 0.1) << radius;
  }
}

TEST(DepthFilter, WholeNoiseIsAveragedLessButWithoutBias)
{
  const cv::Mat depth = noisyWall(1), smoothed = smooth(depth, 6);
  EXPECT_LT(deviation(middle(smoothed)), 0.2 * deviation(middle(depth)));
  EXPECT_NEAR(cv::mean(middle(smoothed))[0], 1, 0.02 * NOISE.sigma(1));
}

TEST(DepthFilter, StepsAndThinThingsStay)
{
  cv::Mat depth = flatFrame(1).depth;
  depth.colRange(160, 320).setTo(1.1); // 40 sigmas
  depth.rowRange(100, 101).setTo(0.8);
  EXPECT_LT(cv::norm(smooth(depth), depth, cv::NORM_INF), 1e-6);
}

TEST(DepthFilter, MissingPixelsStayMissingAndPullAtNothing)
{
  cv::Mat depth = flatFrame(1.5f).depth;
  const float missing[] = {NAN, 0, -1};
  for (int i = 0; i < 3; ++i)
    depth(cv::Rect(50 * i + 40, 30, 20, 1 + 40 * i)).setTo(missing[i]);
  const cv::Mat smoothed = smooth(depth);
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u) {
      ASSERT_EQ(smoothed.at<float>(v, u) > 0, depth.at<float>(v, u) > 0);
      if (depth.at<float>(v, u) > 0) {
        ASSERT_NEAR(smoothed.at<float>(v, u), 1.5, 1e-6);
      }
      else {
        ASSERT_TRUE(std::isnan(smoothed.at<float>(v, u)));
      }
    }
}

TEST(DepthFilter, MissingPixelsPullAtNothingWhateverTheNoise)
{
  cv::Mat depth = flatFrame(1.5f).depth;
  depth(cv::Rect(100, 100, 40, 40)).setTo(NAN);
  DepthNoise large;
  large.constant = 1; // far more than the difference from nothing
  const cv::Mat smoothed = smoothDepth(depth, large, 6, 1);
  EXPECT_NEAR(smoothed.at<float>(99, 120), 1.5, 1e-6);
  EXPECT_NEAR(smoothed.at<float>(0, 0), 1.5, 1e-6);
}

TEST(DepthFilter, AMirroredImageGivesTheMirroredResult)
{
  const cv::Mat depth = noisyWall(1), expected = smooth(depth, 6);
  for (const int axis : {0, 1, -1}) {
    cv::Mat mirrored, back;
    cv::flip(depth, mirrored, axis);
    cv::flip(smooth(mirrored, 6), back, axis);
    EXPECT_LT(cv::norm(back, expected, cv::NORM_INF), 1e-6);
  }
  EXPECT_LT(cv::norm(smooth(depth.t(), 6).t(), expected, cv::NORM_INF), 1e-6);
}

TEST(DepthFilter, IsTheSameForAnyThreadsAndVariant)
{
  cv::Mat depth = noisyWall(1);
  depth(cv::Rect(33, 21, 50, 40)).setTo(NAN);
  for (const int width : {320, 317, 16}) { // vectors reach over the end of some
    const cv::Mat part = depth.colRange(0, width).clone(), expected = smooth(part);
    forEachVariant([&] {
      for (const int threads : {1, 3})
        EXPECT_TRUE(areSame(smooth(part, 10, threads), expected)) << width;
    });
  }
}

TEST(DepthFilter, WithoutRadiusNothingChanges)
{
  const cv::Mat depth = noisyWall(1);
  EXPECT_LT(cv::norm(smooth(depth, 0), depth, cv::NORM_INF), 2e-7);
}
