// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/features.h>

#include "landmarks.h"
#include "messages.h"

#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const float NOTHING = std::numeric_limits<float>::quiet_NaN();

CameraIntrinsics
camera()
{
  return smallCamera(320, 240, 262.5);
}

/** Random blobs everywhere, with a given depth. */
RGBDFrame
texturedFrame(const cv::Mat& depth)
{
  std::mt19937 random(1);
  RGBDFrame frame;
  frame.id = 17;
  frame.color = cv::Mat(240, 320, CV_8UC3, cv::Scalar(90, 90, 90));
  for (int i = 0; i < 700; ++i) {
    const int x = int(random() % 320), y = int(random() % 240);
    const int radius = 2 + int(random() % 6);
    const double grey = double(random() % 256);
    cv::circle(frame.color, {x, y}, radius, {grey, 255 - grey, grey}, cv::FILLED, cv::LINE_AA);
  }
  frame.depth = depth;
  return frame;
}

cv::Mat
wall(float distance)
{
  return cv::Mat(240, 320, CV_32FC1, cv::Scalar(distance));
}

void
expectSame(const Features& a, const Features& b)
{
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.sharpness, b.sharpness);
  EXPECT_EQ(a.pixel_sigmas, b.pixel_sigmas);
  EXPECT_EQ(a.depth_sigmas, b.depth_sigmas);
  EXPECT_EQ(cv::norm(a.descriptors, b.descriptors, cv::NORM_INF), 0);
  for (std::size_t j = 0; j < a.size(); ++j) {
    EXPECT_EQ(a.pixels[j], b.pixels[j]);
    EXPECT_EQ(a.colors[j], b.colors[j]);
    EXPECT_TRUE(a.depths[j] == b.depths[j] || (!a.hasDepth(j) && !b.hasDepth(j)));
  }
}

} // namespace

TEST(Features, ListsHaveOneLengthAndDescriptorsUnitNorm)
{
  const Features features = extractFeatures(texturedFrame(wall(1.5f)), camera());
  ASSERT_GT(features.size(), 200u);
  EXPECT_EQ(features.pixel_sigmas.size(), features.size());
  EXPECT_EQ(features.depths.size(), features.size());
  EXPECT_EQ(features.depth_sigmas.size(), features.size());
  EXPECT_EQ(features.colors.size(), features.size());
  ASSERT_EQ(features.descriptors.rows, int(features.size()));
  ASSERT_EQ(features.descriptors.cols, 128);
  for (int i = 0; i < features.descriptors.rows; ++i) {
    EXPECT_NEAR(cv::norm(features.descriptors.row(i)), 256, 30);
    double largest = 0;
    cv::minMaxLoc(features.descriptors.row(i), nullptr, &largest);
    EXPECT_LE(largest, 127);
  }
}

TEST(Features, DepthOnASlantedPlaneIsExactAtSubPixels)
{
  const Eigen::Vector3d normal = Eigen::Vector3d(0.6, 0.3, 1).normalized();
  const Features features =
      extractFeatures(texturedFrame(planeDepth(camera(), normal, 1.5)), camera());
  std::size_t measured = 0;
  for (std::size_t j = 0; j < features.size(); ++j) {
    if (!features.hasDepth(j))
      continue;
    ++measured;
    EXPECT_NEAR(normal.dot(pointInCamera(features, j, camera())), 1.5, 2e-4);
    // An error of the position reads another depth on the slope.
    EXPECT_GT(features.depth_sigmas[j], DepthNoise().sigma(features.depths[j]));
  }
  EXPECT_GT(measured, 200u);
}

TEST(Features, SigmaFollowsTheNoiseModel)
{
  CameraIntrinsics other = camera();
  other.depth_noise.quadratic = 0.004;
  for (const float distance : {0.8f, 2.0f, 4.0f}) {
    const Features features = extractFeatures(texturedFrame(wall(distance)), other);
    for (std::size_t j = 0; j < features.size(); ++j)
      if (features.hasDepth(j)) {
        EXPECT_NEAR(features.depths[j], distance, 1e-5);
        EXPECT_NEAR(features.depth_sigmas[j], other.depth_noise.sigma(distance), 1e-5);
      }
  }
}

TEST(Features, HaveNoDepthAtADepthEdge)
{
  cv::Mat depth = wall(1);
  depth.colRange(160, 320) = 2;
  const Features features = extractFeatures(texturedFrame(depth), camera());
  std::size_t at_edge = 0;
  for (std::size_t j = 0; j < features.size(); ++j) {
    const Eigen::Vector2f pixel = features.pixels[j];
    const float distance = std::abs(pixel.x() - 159.5f);
    if (distance < 2) {
      ++at_edge;
      EXPECT_FALSE(features.hasDepth(j)) << pixel.transpose();
    }
    else if (distance > 5 && pixel.x() > 4 && pixel.y() > 4 && pixel.x() < 315 && pixel.y() < 235) {
      EXPECT_NEAR(features.depths[j], pixel.x() < 160 ? 1 : 2, 1e-5);
    }
  }
  EXPECT_GT(at_edge, 2u);
}

TEST(Features, HaveNoDepthBeyondAllMeasure)
{
  for (const float z : {1e25f, 3e38f, std::numeric_limits<float>::infinity()}) {
    const Features f =
        extractFeatures(texturedFrame(cv::Mat(240, 320, CV_32FC1, cv::Scalar(z))), camera());
    EXPECT_GT(f.size(), 100u);
    for (std::size_t j = 0; j < f.size(); ++j)
      EXPECT_FALSE(f.hasDepth(j)) << z;
  }
}

TEST(Features, AreNotLookedForInAHole)
{
  cv::Mat depth = wall(1);
  const cv::Rect hole(100, 80, 80, 80);
  depth(hole) = NOTHING;
  const auto numInside = [&hole](const Features& features) {
    return std::count_if(
        features.pixels.begin(), features.pixels.end(), [&hole](const Eigen::Vector2f& pixel) {
          return hole.contains(cv::Point(int(pixel.x()) - 4, int(pixel.y()) - 4)) &&
                 hole.contains(cv::Point(int(pixel.x()) + 4, int(pixel.y()) + 4));
        });
  };
  EXPECT_GT(numInside(extractFeatures(texturedFrame(wall(1)), camera())), 10);
  EXPECT_EQ(numInside(extractFeatures(texturedFrame(depth), camera())), 0);
}

TEST(Features, DependOnTheImageAlone)
{
  const RGBDFrame frame = texturedFrame(wall(1.5f));
  const Features alone = extractFeatures(frame, camera());
  std::vector<Features> together(4);
#pragma omp parallel for num_threads(2)
  for (int i = 0; i < 4; ++i)
    together[i] = extractFeatures(frame, camera());
  for (const Features& features : together)
    expectSame(features, alone);
}

TEST(Features, SharpnessFallsWithBlurAndIgnoresBrightness)
{
  RGBDFrame frame = texturedFrame(wall(1.5f));
  const cv::Mat sharp = frame.color.clone();
  double last = extractFeatures(frame, camera()).sharpness;
  frame.color = 0.6 * sharp;
  EXPECT_NEAR(extractFeatures(frame, camera()).sharpness, last, 0.05 * last);
  for (const double sigma : {1.0, 2.0, 4.0}) {
    cv::GaussianBlur(sharp, frame.color, {}, sigma);
    const double sharpness = extractFeatures(frame, camera()).sharpness;
    EXPECT_LT(sharpness, 0.9 * last) << sigma;
    last = sharpness;
  }
}

TEST(Features, KeepTheStrongest)
{
  FeatureOptions options;
  options.max_features = 50;
  const Features features = extractFeatures(texturedFrame(wall(1.5f)), camera(), options);
  EXPECT_GE(features.size(), 50u);
  EXPECT_LE(features.size(), 60u); // equal responses
}

TEST(Features, AnEmptyImageHasNone)
{
  RGBDFrame frame;
  frame.color = cv::Mat(240, 320, CV_8UC3, cv::Scalar(80, 80, 80));
  frame.depth = wall(1);
  const Features features = extractFeatures(frame, camera());
  EXPECT_EQ(features.size(), 0u);
  EXPECT_TRUE(std::isfinite(features.sharpness));
}

TEST(Features, RefuseImagesOfWrongTypeOrSize)
{
  const RGBDFrame good = texturedFrame(wall(1));
  const auto message = [](const RGBDFrame& frame) {
    return messageOf<pcl::BadArgumentException>([&] { extractFeatures(frame, camera()); });
  };
  RGBDFrame frame = good;
  frame.color = cv::Mat(240, 320, CV_8UC1, cv::Scalar(0));
  EXPECT_CONTAINS(message(frame), "frame 17 needs CV_8UC3 colour and CV_32FC1 depth");
  frame = good;
  frame.depth = cv::Mat(240, 320, CV_16UC1, cv::Scalar(0));
  EXPECT_CONTAINS(message(frame), "frame 17");
  frame = good;
  frame.depth = cv::Mat(120, 160, CV_32FC1, cv::Scalar(1));
  EXPECT_CONTAINS(message(frame), "of the camera's size");
  EXPECT_CONTAINS(message({}), "extractFeatures: frame 0");
}

TEST(Features, RefuseInvalidOptionsAndCameras)
{
  const RGBDFrame frame = texturedFrame(wall(1));
  const auto message = [&](const FeatureOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { extractFeatures(frame, camera(), options); });
  };
  FeatureOptions options;
  options.max_features = 2;
  EXPECT_CONTAINS(message(options), "max_features must be >= 3");
  options = {};
  options.contrast_threshold = 1;
  EXPECT_CONTAINS(message(options), "contrast_threshold must lie in [0, 1)");
  options = {};
  options.depth_radius = 0;
  EXPECT_CONTAINS(message(options), "depth_radius must be >= 1 px");
  options = {};
  options.pixel_sigma = 0;
  EXPECT_CONTAINS(message(options), "pixel_sigma must be > 0");
  EXPECT_CONTAINS(
      messageOf<pcl::BadArgumentException>([&] { extractFeatures(frame, CameraIntrinsics()); }),
      "extractFeatures");
}
