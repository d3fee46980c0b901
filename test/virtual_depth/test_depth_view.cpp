// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/scenes.h"
#include "virtual_depth/depth_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Angle in degrees between the fitted and the true normal of a plane, 90th percentile. */
double
normalError(const DepthView& view, const Eigen::Vector3d& truth)
{
  std::vector<double> angles;
  for (int i = 0; i < int(view.normals.total()); ++i) {
    const float* n = view.normals.ptr<float>() + 3 * i;
    if (std::isfinite(n[0]))
      angles.push_back(degrees(
          std::acos(std::min(1.0, std::abs(truth.dot(Eigen::Vector3d(n[0], n[1], n[2])))))));
  }
  std::sort(angles.begin(), angles.end());
  EXPECT_GT(angles.size(), view.normals.total() * 9 / 10);
  return angles[angles.size() * 9 / 10];
}

/** A foreground square at 1 m before a wall at 2 m. */
cv::Mat
squareBeforeWall(const CameraIntrinsics& camera)
{
  cv::Mat depth(camera.height, camera.width, CV_32F, cv::Scalar(2));
  depth(cv::Rect(camera.width / 4, camera.height / 4, camera.width / 2, camera.height / 2)) = 1.0f;
  return depth;
}

} // namespace

TEST(DepthView, NormalsOfAPlaneAreExact)
{
  const Eigen::Vector3d normal = Eigen::Vector3d(0.4, -0.3, 1).normalized();
  const DepthView view = makeDepthView(planeDepth(smallCamera(), normal, 1.5), smallCamera());
  EXPECT_LT(normalError(view, normal), 0.05);
}

TEST(DepthView, NormalsPointTowardsTheCamera)
{
  const DepthView view =
      makeDepthView(room().render(room().worldFromCamera(0)).depth, room().camera());
  for (int v = 0; v < view.depth.rows; ++v)
    for (int u = 0; u < view.depth.cols; ++u) {
      const cv::Vec3f n = view.normals.at<cv::Vec3f>(v, u);
      if (!std::isfinite(n[0]))
        continue;
      const Eigen::Vector3d ray = view.camera.unproject(u, v, 1);
      EXPECT_LT(ray.dot(Eigen::Vector3d(n[0], n[1], n[2])), 0);
      EXPECT_NEAR(cv::norm(n), 1, 1e-4);
    }
}

TEST(DepthView, NormalsAtThreeMetresSurviveTheNoise)
{
  const CameraIntrinsics camera = smallCamera(640, 480, 525);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, 0.1, 1).normalized();
  const cv::Mat depth = noisy(planeDepth(camera, normal, 3 * normal.z()), 1);
  // The window is chosen for a standard deviation of 4 degrees per axis; 2.15 of these
  // is the 90th percentile of the angle.
  EXPECT_LT(normalError(makeDepthView(depth, camera), normal), 9);
}

TEST(DepthView, WeightFollowsTheNoiseModel)
{
  for (const double z : {0.6, 1.5, 3.0}) {
    const DepthView view = makeDepthView(planeDepth(smallCamera(), {0, 0, 1}, z), smallCamera());
    const double expected = 1 / std::pow(DepthNoise().sigma(z), 2);
    EXPECT_NEAR(view.weight.at<float>(60, 80) / expected, 1, 0.01) << z;
  }
}

TEST(DepthView, WeightFallsTowardsEdgesAndHoles)
{
  const CameraIntrinsics camera = smallCamera();
  cv::Mat depth = squareBeforeWall(camera);
  depth.at<float>(10, 10) = std::numeric_limits<float>::quiet_NaN();
  const DepthView view = makeDepthView(depth, camera);
  const int edge = camera.width / 4, row = camera.height / 2;
  float previous = 0;
  for (int step = 0; step < 3; ++step) {
    const float weight = view.weight.at<float>(row, edge + step);
    EXPECT_GT(weight, previous) << step;
    previous = weight;
  }
  EXPECT_EQ(view.weight.at<float>(10, 10), 0);
  EXPECT_LT(view.weight.at<float>(10, 11), view.weight.at<float>(10, 14));
}

TEST(DepthView, FlyingPixelsAndSteepSurfacesWeighNothing)
{
  const CameraIntrinsics camera = smallCamera();
  cv::Mat depth = squareBeforeWall(camera);
  depth.col(camera.width / 4) = 1.5f; // a column of mixed depth between both surfaces
  const DepthView view = makeDepthView(depth, camera);
  EXPECT_EQ(view.weight.at<float>(camera.height / 2, camera.width / 4), 0);
  VirtualDepthOptions options;
  options.max_view_angle = 40;
  const Eigen::Vector3d steep(std::sin(M_PI / 3), 0, std::cos(M_PI / 3));
  const DepthView tilted = makeDepthView(planeDepth(camera, steep, 1), camera, 1, options);
  EXPECT_EQ(tilted.weight.at<float>(60, 80), 0);
}

TEST(DepthView, ReductionKeepsPlanesAndEdges)
{
  const CameraIntrinsics camera = smallCamera();
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, 0.2, 1).normalized();
  const DepthView plane = makeDepthView(planeDepth(camera, normal, 1.5), camera, 2);
  EXPECT_EQ(plane.depth.cols, camera.width / 2);
  const cv::Mat truth = planeDepth(camera.reduced(2), normal, 1.5);
  EXPECT_LT(absoluteErrors(plane.depth, truth).back(), 1e-3);
  cv::Mat depth = squareBeforeWall(camera);
  const DepthView edge = makeDepthView(depth, camera, 3);
  for (int i = 0; i < int(edge.depth.total()); ++i) {
    const float z = edge.depth.ptr<float>()[i];
    EXPECT_TRUE(z == 1 || z == 2) << "an average across the edge: " << z;
  }
}

TEST(DepthView, TakesZeroNegativeAndInfiniteAsNotMeasured)
{
  cv::Mat depth(120, 160, CV_32F, cv::Scalar(1));
  depth.at<float>(5, 5) = 0;
  depth.at<float>(5, 6) = -1;
  depth.at<float>(5, 7) = std::numeric_limits<float>::infinity();
  const DepthView view = makeDepthView(depth, smallCamera());
  for (const int u : {5, 6, 7}) {
    EXPECT_TRUE(std::isnan(view.depth.at<float>(5, u)));
    EXPECT_EQ(view.weight.at<float>(5, u), 0);
  }
}
