// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/tsdf_raycast.h>

#include <gtest/gtest.h>
#include <pcl/common/point_tests.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double radius = 0.3;
constexpr double voxel_size = 0.01;

TSDFVolume
fuse(const Intersection& scene, const std::vector<Pose>& poses)
{
  TSDFOptions options;
  options.voxel_size = voxel_size;
  options.truncation = 4 * voxel_size;
  TSDFVolume volume(options);
  for (const Pose& pose : poses)
    volume.integrate(render(scene, pose), smallCamera(), pose);
  return volume;
}

/** The six walls of a room, seen from within. */
Intersection
room()
{
  return [](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        const double t = (side * (1 + 0.2 * axis) - origin[axis]) / ray[axis];
        nearest = t > 0 ? std::min(nearest, t) : nearest;
      }
    return nearest;
  };
}

} // namespace

TEST(Raycast, SphereLiesWithinHalfAVoxelOfTheTruth)
{
  const TSDFVolume volume = fuse(sphere(radius), posesAllAround(1));
  const Pose pose = lookAt({0.5, -0.6, 0.7}, {0, 0, 0}); // none of those fused
  const auto view = raycast(volume, smallCamera(), pose);
  ASSERT_EQ(view->width, 320u);
  ASSERT_EQ(view->height, 240u);
  const RGBDFrame truth = render(sphere(radius), pose);
  std::size_t on_sphere = 0, seen = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const auto& point = (*view)(x, y);
      const bool hit = pcl::isFinite(point);
      seen += hit;
      on_sphere += truth.depth.at<float>(y, x) > 0;
      if (!hit)
        continue;
      const Eigen::Vector3f position = point.getVector3fMap();
      EXPECT_NEAR(position.norm(), radius, voxel_size / 2);
      EXPECT_GT(position.normalized().dot(point.getNormalVector3fMap()), 0.95);
      const Eigen::Vector2d pixel = smallCamera().project(pose.inverse() * position.cast<double>());
      EXPECT_NEAR(pixel.x(), x, 0.01);
      EXPECT_NEAR(pixel.y(), y, 0.01);
      EXPECT_NEAR(point.r, 150, 3); // BGR 50, 100, 150
      EXPECT_NEAR(point.b, 50, 3);
    }
  EXPECT_GT(seen, on_sphere * 95 / 100); // but for the rim
  EXPECT_LE(seen, on_sphere * 102 / 100);
}

TEST(Raycast, RoomFromWithinHasNoHoles)
{
  const TSDFVolume volume = fuse(room(), posesAllAround(0.1));
  const Pose pose = lookAt({-0.05, 0.02, -0.02}, {1, 0, 0}); // a little ahead of one fused
  const auto view = raycast(volume, smallCamera(), pose);
  const RGBDFrame truth = render(room(), pose);
  std::size_t seen = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x)
      if (pcl::isFinite((*view)(x, y))) {
        ++seen;
        const Eigen::Vector3d in_camera =
            pose.inverse() * (*view)(x, y).getVector3fMap().cast<double>();
        // Where two walls meet, the projective distance rounds the corner.
        EXPECT_NEAR(in_camera.z(), truth.depth.at<float>(y, x), 2 * voxel_size);
      }
  EXPECT_GT(seen, view->size() * 97 / 100);
}

TEST(Raycast, SeesNothingFromBehindNorWithoutSurface)
{
  const TSDFVolume wall = fuse(plane({0, 0, 1}, 1.0), {Pose::Identity()});
  const auto behind = raycast(wall, smallCamera(), lookAt({0, 0, 2}, {0, 0, 0}));
  const auto away = raycast(wall, smallCamera(), lookAt({0, 0, 0}, {0, 0, -1}));
  const auto empty = raycast(TSDFVolume(), smallCamera(), Pose::Identity());
  for (const auto& view : {behind, away, empty})
    for (const auto& point : *view)
      ASSERT_FALSE(pcl::isFinite(point));
}

TEST(Raycast, DoesNotDependOnThreads)
{
  const TSDFVolume volume = fuse(sphere(radius), posesAllAround(1));
  const Pose pose = lookAt({0.5, -0.6, 0.7}, {0, 0, 0});
  const auto one = raycast(volume, smallCamera(), pose, 1);
  const auto three = raycast(volume, smallCamera(), pose, 3);
  for (std::size_t i = 0; i < one->size(); ++i) {
    ASSERT_EQ(pcl::isFinite((*one)[i]), pcl::isFinite((*three)[i]));
    if (pcl::isFinite((*one)[i])) {
      ASSERT_EQ((*one)[i].getVector3fMap(), (*three)[i].getVector3fMap());
    }
  }
}

TEST(Raycast, RefusesWhatIsNoView)
{
  const auto refusal = [](const CameraIntrinsics& camera, const Pose& pose) {
    return messageOf<pcl::BadArgumentException>([&] { raycast(TSDFVolume(), camera, pose); });
  };
  CameraIntrinsics distorted = smallCamera(), impossible = smallCamera();
  distorted.k1 = 0.1;
  impossible.fx = 0;
  Pose stretched = Pose::Identity();
  stretched.linear() *= 2;
  EXPECT_CONTAINS(refusal(distorted, Pose::Identity()), "has distortion");
  EXPECT_CONTAINS(refusal(impossible, Pose::Identity()), "raycast: ");
  EXPECT_CONTAINS(refusal(smallCamera(), stretched), "not a rigid motion");
}
