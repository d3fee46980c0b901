// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/rendered_frame.h"

#include <bundle_icp/surface/preview.h>
#include <bundle_icp/surface/tsdf_marching_cubes.h>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const cv::Vec3b white(255, 255, 255);

pcl::PolygonMesh
sphereMesh()
{
  TSDFOptions options;
  options.voxel_size = 0.01;
  auto volume = std::make_shared<TSDFVolume>(options);
  for (const Pose& pose : posesAllAround(1.0))
    volume->integrate(render(sphere(0.3), pose), smallCamera(), pose);
  TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
  cubes.setVolume(volume);
  pcl::PolygonMesh mesh;
  cubes.reconstruct(mesh);
  return mesh;
}

// Box of what is not white.
cv::Rect
paintedBox(const cv::Mat& picture)
{
  cv::Mat gray;
  cv::cvtColor(picture, gray, cv::COLOR_BGR2GRAY);
  return cv::boundingRect(gray < 250);
}

} // namespace

TEST(Preview, SphereAppearsWhereTheCameraSeesIt)
{
  const Pose pose = lookAt({0, 0, -1}, {0, 0, 0});
  const CameraIntrinsics camera = smallCamera();
  const cv::Mat picture = renderMeshPreview(sphereMesh(), camera, pose);
  ASSERT_EQ(picture.size(), cv::Size(camera.width, camera.height));
  ASSERT_EQ(picture.type(), CV_8UC3);
  EXPECT_EQ(picture.at<cv::Vec3b>(5, 5), white);
  const cv::Vec3b middle = picture.at<cv::Vec3b>(120, 160);
  EXPECT_NEAR(middle[0], 50, 4);
  EXPECT_NEAR(middle[1], 100, 5);
  EXPECT_NEAR(middle[2], 150, 6);
  // The outline of a sphere of radius r at distance d: f r / sqrt(d^2 - r^2).
  const double outline = camera.fx * 0.3 / std::sqrt(1 - 0.09);
  const cv::Rect box = paintedBox(picture);
  EXPECT_NEAR(box.width, 2 * outline, 4);
  EXPECT_NEAR(box.height, 2 * outline, 4);
  EXPECT_NEAR(box.x + box.width / 2.0, camera.cx, 3);
}

TEST(Preview, BacksOfFacesAreLeftOut)
{
  // From inside the sphere all faces are seen from behind.
  const cv::Mat picture =
      renderMeshPreview(sphereMesh(), smallCamera(), Pose::Identity());
  EXPECT_EQ(paintedBox(picture).area(), 0);
}

TEST(Preview, ChosenPoseShowsTheWholeMesh)
{
  const pcl::PolygonMesh mesh = sphereMesh();
  const CameraIntrinsics camera = smallCamera();
  for (const std::vector<Pose>& cameras :
       {std::vector<Pose>{lookAt({0.2, 0.1, -0.6}, {0.1, 0, 0})},
        posesAllAround(1.0)}) {
    const cv::Rect box = paintedBox(
        renderMeshPreview(mesh, camera, choosePreviewPose(mesh, camera, cameras)));
    EXPECT_GT(box.x, 0);
    EXPECT_GT(box.y, 0);
    EXPECT_LT(box.br().x, camera.width);
    EXPECT_LT(box.br().y, camera.height);
    EXPECT_GT(box.height, 0.8 * camera.height);
  }
}

TEST(Preview, TrajectoryPlotShowsBothPaths)
{
  std::vector<Pose> path, truth;
  for (int i = 0; i < 20; ++i) {
    path.push_back(lookAt({0.1 * i, 0.3, -2}, {0.1 * i, 0, 0}));
    truth.push_back(path.back());
    truth.back().translation().z() += 0.2;
  }
  const cv::Mat alone = renderTrajectoryPreview(path);
  const cv::Mat both = renderTrajectoryPreview(path, truth);
  EXPECT_EQ(alone.size(), cv::Size(1280, 640));
  EXPECT_EQ(alone.at<cv::Vec3b>(2, 2), white);
  EXPECT_GT(cv::norm(alone, both, cv::NORM_INF), 100);
  // A camera that does not move has no extent to scale by.
  EXPECT_FALSE(renderTrajectoryPreview({path[0]}).empty());
}

TEST(Preview, RefusesBadArguments)
{
  const pcl::PolygonMesh mesh = sphereMesh();
  const Pose pose = Pose::Identity();
  CameraIntrinsics wrong = smallCamera();
  wrong.width = 0;
  EXPECT_THROW(renderMeshPreview(mesh, wrong, pose), pcl::BadArgumentException);
  EXPECT_THROW(renderMeshPreview({}, smallCamera(), pose), pcl::BadArgumentException);
  EXPECT_THROW(choosePreviewPose(mesh, smallCamera(), {}), pcl::BadArgumentException);
  EXPECT_THROW(renderTrajectoryPreview({}), pcl::BadArgumentException);
  Pose bad = pose;
  bad.translation().x() = NAN;
  EXPECT_THROW(renderMeshPreview(mesh, smallCamera(), bad), pcl::BadArgumentException);
  EXPECT_THROW(renderTrajectoryPreview({bad}), pcl::BadArgumentException);
  EXPECT_THROW(renderTrajectoryPreview({pose}, {bad}), pcl::BadArgumentException);
  pcl::PolygonMesh broken = mesh;
  broken.polygons[0].vertices[0] = 100000000;
  EXPECT_THROW(renderMeshPreview(broken, smallCamera(), pose),
               pcl::BadArgumentException);
}
