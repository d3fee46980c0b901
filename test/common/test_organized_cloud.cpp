// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/organized_cloud.h>

#include "messages.h"

#include <opencv2/core.hpp>
#include <pcl/exceptions.h>

#include <cmath>
#include <limits>

using namespace bundle_icp;

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGBA>;

CameraIntrinsics
camera()
{
  CameraIntrinsics camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = 60;
  camera.fy = 62;
  camera.cx = 30.5;
  camera.cy = 24.25;
  return camera;
}

/** Of a wavy wall, in the frame of the camera. */
Cloud
wall()
{
  Cloud cloud(64, 48);
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) {
      const double z = 1.5 + 0.3 * std::sin(0.2 * u) + 0.01 * v;
      cloud(u, v).getVector3fMap() = camera().unproject(u, v, z).cast<float>();
      cloud(u, v).r = std::uint8_t(u);
      cloud(u, v).g = std::uint8_t(v);
      cloud(u, v).b = std::uint8_t(u + v);
    }
  return cloud;
}

std::string
frameError(const Cloud& cloud, const CameraIntrinsics& camera)
{
  return messageOf<pcl::BadArgumentException>([&] { toFrame(cloud, camera, 0); });
}

std::string
intrinsicsError(const Cloud& cloud)
{
  return messageOf<pcl::BadArgumentException>([&] { intrinsicsOf(cloud); });
}

} // namespace

TEST(OrganizedCloud, BecomesAFrame)
{
  const Cloud cloud = wall();
  const RGBDFrame frame = toFrame(cloud, camera(), 12.5);
  EXPECT_EQ(frame.timestamp, 12.5);
  ASSERT_EQ(frame.color.type(), CV_8UC3);
  ASSERT_EQ(frame.depth.type(), CV_32FC1);
  ASSERT_EQ(frame.color.size(), cv::Size(64, 48));
  ASSERT_EQ(frame.depth.size(), cv::Size(64, 48));
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) {
      EXPECT_EQ(frame.depth.at<float>(v, u), cloud(u, v).z);
      EXPECT_EQ(frame.color.at<cv::Vec3b>(v, u), cv::Vec3b(u + v, v, u));
    }
}

TEST(OrganizedCloud, PointsThatAreNoneHaveNoDepth)
{
  Cloud cloud = wall();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud(1, 2).z = nan;
  cloud(2, 2).x = nan;
  cloud(3, 2).z = 0;
  cloud(4, 2).z = -1;
  cloud(5, 2).z = std::numeric_limits<float>::infinity();
  const RGBDFrame frame = toFrame(cloud, camera(), 0);
  for (int u = 1; u <= 5; ++u)
    EXPECT_TRUE(std::isnan(frame.depth.at<float>(2, u))) << u;
  EXPECT_EQ(frame.depth.at<float>(2, 6), cloud(6, 2).z);
  EXPECT_EQ(frame.color.at<cv::Vec3b>(2, 1), cv::Vec3b(3, 2, 1)); // colour without depth stays
}

TEST(OrganizedCloud, TellsItsCamera)
{
  const CameraIntrinsics found = intrinsicsOf(wall());
  EXPECT_EQ(found.width, 64);
  EXPECT_EQ(found.height, 48);
  EXPECT_NEAR(found.fx, 60, 1e-3);
  EXPECT_NEAR(found.fy, 62, 1e-3);
  EXPECT_NEAR(found.cx, 30.5, 1e-3);
  EXPECT_NEAR(found.cy, 24.25, 1e-3);
}

TEST(OrganizedCloud, HolesDoNotChangeTheCamera)
{
  Cloud cloud = wall();
  for (std::size_t i = 0; i < cloud.size(); i += 3)
    cloud[i].z = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(intrinsicsOf(cloud).fx, 60, 1e-3);
}

TEST(OrganizedCloud, UnorganizedOnesAreRefused)
{
  Cloud cloud;
  cloud.resize(64 * 48);
  EXPECT_CONTAINS(frameError(cloud, camera()),
                  "toFrame: the cloud is not organized: 3072 points in 3072 columns and 1 rows");
  EXPECT_CONTAINS(intrinsicsError(cloud), "intrinsicsOf: the cloud is not organized");
  cloud.width = 64;
  cloud.height = 50;
  EXPECT_CONTAINS(frameError(cloud, camera()), "3072 points in 64 columns and 50 rows");
  EXPECT_CONTAINS(frameError(Cloud(), camera()), "0 points in 0 columns");
}

TEST(OrganizedCloud, NeedsTheSizeOfTheCamera)
{
  CameraIntrinsics other = camera();
  other.width = 128;
  EXPECT_CONTAINS(frameError(wall(), other),
                  "the cloud has 64 x 48 points, the camera 128 x 48 pixels");
  EXPECT_CONTAINS(frameError(wall(), CameraIntrinsics()), "toFrame: ");
  other = camera();
  other.k1 = 0.1;
  EXPECT_CONTAINS(frameError(wall(), other), "the camera of a cloud has no distortion");
}

TEST(OrganizedCloud, AnotherFrameIsRefused)
{
  Cloud robot = wall();
  for (pcl::PointXYZRGBA& point : robot) // x forward, y left, z up
    point.getVector3fMap() = Eigen::Vector3f(point.z, -point.x, 1 - point.y);
  EXPECT_CONTAINS(frameError(robot, camera()), "most points lie far from their pixels");
  EXPECT_CONTAINS(intrinsicsError(robot), "not those of a camera that looks along z");
  Cloud empty(64, 48);
  for (pcl::PointXYZRGBA& point : empty)
    point.z = std::numeric_limits<float>::quiet_NaN();
  EXPECT_CONTAINS(intrinsicsError(empty), "hardly a point");
  EXPECT_EQ(cv::countNonZero(toFrame(empty, camera(), 0).depth > 0), 0); // a frame without depth
}
