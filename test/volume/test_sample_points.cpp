// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/object_region.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

std::string
refusal(const RGBDFrame& frame, const CameraIntrinsics& camera = smallCamera(), int step = 6)
{
  return messageOf<pcl::BadArgumentException>([&] { samplePoints(frame, camera, step); });
}

const Eigen::Vector3d NORMAL(0.3, -0.2, 1);

RGBDFrame
slantedWall()
{
  return render(plane(NORMAL, 1.1), Pose::Identity());
}

} // namespace

TEST(SamplePoints, LieOnTheSurfaceAtEachStepOfTheImage)
{
  for (const int step : {1, 2, 6, 50}) {
    const auto cloud = samplePoints(slantedWall(), smallCamera(), step);
    std::vector<Eigen::Vector2i> pixels;
    for (const pcl::PointXYZ& point : cloud) {
      const Eigen::Vector3d p = point.getVector3fMap().cast<double>();
      EXPECT_NEAR(NORMAL.dot(p), 1.1, 1e-6);
      pixels.emplace_back(smallCamera().project(p).array().round().cast<int>());
    }
    std::vector<Eigen::Vector2i> expected;
    for (int v = step; v < 239; v += step)
      for (int u = step; u < 319; u += step)
        expected.emplace_back(u, v);
    EXPECT_EQ(pixels, expected) << step;
  }
}

TEST(SamplePoints, LeaveOutDepthEdgesAndMissingPixels)
{
  RGBDFrame frame = slantedWall();
  frame.depth(cv::Rect(100, 80, 60, 50)).setTo(0.7f); // in front
  frame.depth(cv::Rect(200, 80, 60, 50)).setTo(NAN);
  const auto cloud = samplePoints(frame, smallCamera(), 1);
  std::size_t front = 0;
  for (const pcl::PointXYZ& point : cloud) {
    const Eigen::Vector2d pixel = smallCamera().project(point.getVector3fMap().cast<double>());
    const bool is_front = point.z < 0.71f;
    front += is_front;
    if (is_front) {
      EXPECT_TRUE(pixel.x() > 100.5 && pixel.x() < 158.5 && pixel.y() > 80.5 && pixel.y() < 128.5);
    }
  }
  EXPECT_EQ(front, 58u * 48u);
  // Without the two rectangles and the pixels of the wall along their four sides
  EXPECT_EQ(cloud.size() - front, 318u * 238u - 2u * (60u * 50u + 2u * 60u + 2u * 50u));
}

TEST(SamplePoints, AreNoneOfAnImageWithoutDepth)
{
  RGBDFrame frame = slantedWall();
  for (const float nothing : {0.0f, -1.0f, NAN}) {
    frame.depth.setTo(nothing);
    EXPECT_TRUE(samplePoints(frame, smallCamera(), 1).empty()) << nothing;
  }
}

TEST(SamplePoints, RefuseImagesOfAnotherCameraAndStepsBelowOne)
{
  const RGBDFrame good = slantedWall();
  EXPECT_CONTAINS(refusal(good, smallCamera(), 0), "samplePoints: step 0; expected 1 or more");
  EXPECT_CONTAINS(refusal(good, smallCamera(), -3), "samplePoints: step -3; expected 1 or more");
  CameraIntrinsics camera = smallCamera();
  camera.fx = 0;
  EXPECT_CONTAINS(refusal(good, camera), "samplePoints: ");
  const std::string wanted = "samplePoints: depth must be CV_32FC1 in metres, of the camera's size";
  camera = smallCamera();
  camera.width = 319;
  EXPECT_CONTAINS(refusal(good, camera), wanted);
  RGBDFrame frame;
  EXPECT_CONTAINS(refusal(frame), wanted);
  good.depth.convertTo(frame.depth, CV_16UC1, 1000);
  EXPECT_CONTAINS(refusal(frame), wanted);
}
