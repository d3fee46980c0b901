// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/preview.h"
#include "volume/rendered_frame.h"

#include <bundle_icp/volume/extract_surface.h>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

SurfaceMesh
sphereMesh()
{
  TSDFOptions options;
  options.voxel_size = 0.01;
  TSDFVolume volume(options);
  for (const Pose& pose : posesAllAround(1.0))
    volume.integrate(render(sphere(0.3), pose), smallCamera(), pose);
  return extractSurface(volume);
}

// Box of what is darker than paper and grid.
cv::Rect
paintedBox(const cv::Mat& picture)
{
  cv::Mat gray;
  cv::cvtColor(picture, gray, cv::COLOR_BGR2GRAY);
  return cv::boundingRect(gray < 200);
}

} // namespace

TEST(Preview, MeshFillsThePictureInItsColours)
{
  const SurfaceMesh mesh = sphereMesh();
  for (const std::vector<Pose>& cameras :
       {std::vector<Pose>{lookAt({0.2, 0.1, -0.6}, {0.1, 0, 0})}, posesAllAround(1.0)}) {
    const cv::Mat picture = drawMesh(mesh, cameras);
    ASSERT_EQ(picture.size(), cv::Size(1280, 960));
    ASSERT_EQ(picture.type(), CV_8UC3);
    const cv::Rect box = paintedBox(picture);
    EXPECT_GT(box.y, 0);
    EXPECT_LT(box.br().y, picture.rows);
    EXPECT_GT(box.height, 0.8 * picture.rows);
    EXPECT_NEAR(double(box.width) / box.height, 1, 0.1); // a sphere
    EXPECT_NEAR(box.x + box.width / 2, 640, 10);
    const cv::Vec3b middle = picture.at<cv::Vec3b>(box.y + box.height / 2, box.x + box.width / 2);
    EXPECT_NEAR(middle[0], 50, 4);
    EXPECT_NEAR(middle[1], 100, 5);
    EXPECT_NEAR(middle[2], 150, 6);
  }
}

TEST(Preview, NearestFacesAreSeenAndBacksLeftOut)
{
  SurfaceMesh mesh = sphereMesh();
  const std::vector<Pose> cameras{lookAt({0, 0, -1}, {0, 0, 0})};
  // What is nearer is red, and drawn first or last.
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    mesh.colors[i] = {std::uint8_t(mesh.vertices[i].z() < 0 ? 255 : 0), 0, 0};
  std::reverse(mesh.triangles.begin(), mesh.triangles.begin() + mesh.triangles.size() / 2);
  EXPECT_GT(drawMesh(mesh, cameras).at<cv::Vec3b>(480, 640)[2], 240);
  for (auto& triangle : mesh.triangles) // inside out: one looks at the far side
    std::swap(triangle[0], triangle[1]);
  EXPECT_LT(drawMesh(mesh, cameras).at<cv::Vec3b>(480, 640)[2], 10);
}

TEST(Preview, TrajectoryIsDrawnFromAboveAndFromTheSide)
{
  std::vector<Pose> path;
  for (int i = 0; i < 20; ++i)
    path.push_back(lookAt({0.1 * i, 0, -2}, {0.1 * i, 0, 0}));
  cv::Mat picture = drawTrajectory(path);
  ASSERT_EQ(picture.size(), cv::Size(1280, 640));
  picture = picture(cv::Rect(2, 40, 1276, 598)); // without titles and frame
  const cv::Rect above = paintedBox(picture.colRange(0, 630)),
                 side = paintedBox(picture.colRange(650, 1276));
  EXPECT_NEAR(above.width, 640 / 1.2, 20); // from left to right
  EXPECT_LT(above.height, 15);
  EXPECT_LT(side.width, 15); // all in one place
  // A camera that does not move has no extent to scale by.
  EXPECT_GT(paintedBox(drawTrajectory({path[0]})).area(), 0);
}
