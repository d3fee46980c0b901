// SPDX-License-Identifier: BSD-3-Clause
#include <bundle_icp/common/camera_intrinsics.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;

namespace {
CameraIntrinsics
kinect()
{
  CameraIntrinsics camera = parseIntrinsics("517.3,516.5,318.6,255.3");
  camera.width = 640;
  camera.height = 480;
  return camera;
}
} // namespace

TEST(CameraIntrinsics, UnprojectInvertsProject)
{
  const CameraIntrinsics camera = kinect();
  const Eigen::Vector2d pixel = camera.project(camera.unproject(12.5, 400.25, 1.75));
  EXPECT_NEAR(pixel.x(), 12.5, 1e-12);
  EXPECT_NEAR(pixel.y(), 400.25, 1e-12);
}

TEST(CameraIntrinsics, ReducedSeesTheSameRays)
{
  const CameraIntrinsics camera = kinect(), half = camera.reduced(2);
  // The centre of a reduced pixel is the centre of the 2 x 2 block that it covers.
  const Eigen::Vector3d ray = half.unproject(10, 20, 1.0);
  const Eigen::Vector2d pixel = camera.project(ray);
  EXPECT_NEAR(pixel.x(), 20.5, 1e-9);
  EXPECT_NEAR(pixel.y(), 40.5, 1e-9);
  EXPECT_EQ(half.width, 320);
}

TEST(CameraIntrinsics, RefusesImpossibleNumbers)
{
  std::string error;
  EXPECT_TRUE(kinect().isValid(&error)) << error;
  for (const double focal : {0.0, -500.0, 1.0, 1e6, std::nan("")}) {
    CameraIntrinsics camera = kinect();
    camera.fx = focal;
    EXPECT_FALSE(camera.isValid(&error)) << focal;
    EXPECT_NE(error.find("impossible camera intrinsics"), std::string::npos);
  }
  CameraIntrinsics camera = kinect();
  camera.cx = 700;
  EXPECT_FALSE(camera.isValid());
  camera = kinect();
  camera.width = 0;
  EXPECT_FALSE(camera.isValid());
}

TEST(CameraIntrinsics, ParsesFourOrNineNumbersOnly)
{
  const CameraIntrinsics camera = parseIntrinsics("1,2,3,4,.1,.2,.3,.4,.5");
  EXPECT_EQ(camera.k3, 0.5);
  EXPECT_EQ(camera.p1, 0.3);
  for (const char* text : {"", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1,2,3,4x"})
    EXPECT_THROW(parseIntrinsics(text), pcl::BadArgumentException) << text;
}
