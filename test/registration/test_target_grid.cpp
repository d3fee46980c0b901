// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/target_grid.h"

#include "scenes.h"

#include <gtest/gtest.h>
#include <pcl/common/transforms.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;

const Eigen::Vector3d PLANE_NORMAL = Eigen::Vector3d(0.2, -0.3, 1).normalized();

/** The target that a camera renders of a plane, in the world. */
Cloud::Ptr
renderedPlane(const CameraIntrinsics& camera, const Pose& world_from_virtual)
{
  const Cloud::Ptr cloud =
      toPointCloud(makeDepthView(planeDepth(camera, PLANE_NORMAL, 1.5), camera));
  pcl::transformPointCloudWithNormals(*cloud, *cloud, world_from_virtual.matrix().cast<float>());
  return cloud;
}

struct GridOf {
  std::optional<TargetGrid> grid;
  std::string reason;

  GridOf(const PointsView& target, const CameraIntrinsics& camera, const Pose& world_from_virtual)
  {
    AlignmentProblem problem;
    problem.camera = camera;
    grid = makeTargetGrid(problem, target, world_from_virtual, reason);
  }
};

} // namespace

TEST(TargetGrid, OfATargetWithNormalsIsThatTarget)
{
  const CameraIntrinsics camera = smallCamera();
  const Pose pose = randomMotion(1, 1, 2);
  const Cloud::Ptr cloud = renderedPlane(camera, pose);
  const GridOf made(viewPoints(*cloud), camera, pose);
  ASSERT_TRUE(made.grid) << made.reason;
  EXPECT_EQ(made.grid->points.xyz, &cloud->front().x);
  EXPECT_EQ(made.grid->points.normals, &cloud->front().normal_x);
  EXPECT_TRUE(made.grid->storage.empty());
  EXPECT_EQ(made.grid->world_from_virtual.matrix(), pose.matrix());
  EXPECT_EQ(made.grid->camera.width, camera.width);
}

TEST(TargetGrid, ComputesTheNormalsThatAreMissingInTheWorldFrame)
{
  const CameraIntrinsics camera = smallCamera();
  const Pose pose = randomMotion(2, 1, 2);
  const Cloud::Ptr cloud = renderedPlane(camera, pose);
  PointsView bare = viewPoints(*cloud);
  bare.normals = nullptr;
  const GridOf made(bare, camera, pose);
  ASSERT_TRUE(made.grid) << made.reason;
  const Eigen::Vector3f towards_camera = (pose.linear() * -PLANE_NORMAL).cast<float>();
  const PointsView& points = made.grid->points;
  std::size_t known = 0;
  for (std::size_t i = 0; i < points.size; ++i) {
    const Eigen::Map<const Eigen::Vector3f> p(points.xyz + i * points.stride),
        n(points.normals + i * points.stride);
    ASSERT_EQ(p, (*cloud)[i].getVector3fMap());
    if (!n.allFinite())
      continue; // at the border
    ++known;
    ASSERT_LT((n - towards_camera).norm(), 2e-3);
  }
  EXPECT_GT(known, points.size * 9 / 10);
  EXPECT_TRUE(hasUnitNormals(points));
}

TEST(TargetGrid, OfAReducedTargetHasTheReducedCamera)
{
  const CameraIntrinsics camera = smallCamera(320, 240, 262.5);
  const CameraIntrinsics half = camera.reduced(2);
  const Cloud::Ptr cloud = renderedPlane(half, Pose::Identity());
  const GridOf made(viewPoints(*cloud), camera, Pose::Identity());
  ASSERT_TRUE(made.grid) << made.reason;
  EXPECT_EQ(made.grid->camera.width, 160);
  EXPECT_EQ(made.grid->camera.fx, half.fx);
  EXPECT_EQ(made.grid->camera.cx, half.cx);
}

TEST(TargetGrid, IsThatOfFramesWithoutDistortion)
{
  CameraIntrinsics camera = smallCamera();
  const Cloud::Ptr cloud = renderedPlane(camera, Pose::Identity());
  camera.k1 = 0.3;
  const GridOf made(viewPoints(*cloud), camera, Pose::Identity());
  ASSERT_TRUE(made.grid) << made.reason;
  EXPECT_FALSE(made.grid->camera.hasDistortion());
}

TEST(TargetGrid, RefusesACloudWithoutGrid)
{
  Cloud list(500, 1);
  const GridOf made(viewPoints(list), smallCamera(), Pose::Identity());
  EXPECT_FALSE(made.grid);
  EXPECT_EQ(made.reason, "the target is not organized");
}

TEST(TargetGrid, RefusesAGridThatIsNotTheCamerasAndSaysBothSizes)
{
  const Cloud::Ptr cloud = renderedPlane(smallCamera(), Pose::Identity());
  for (const auto& [width, height] :
       {std::pair(200, 120), std::pair(160, 100), std::pair(80, 60)}) {
    const GridOf made(viewPoints(*cloud), smallCamera(width, height), Pose::Identity());
    EXPECT_FALSE(made.grid);
    EXPECT_EQ(made.reason, "the target has 160x120 points, the camera " + std::to_string(width) +
                               "x" + std::to_string(height) + " pixels");
  }
}

TEST(TargetGrid, RefusesATargetThatWasSeenFromElsewhere)
{
  const CameraIntrinsics camera = smallCamera();
  const Cloud::Ptr cloud = renderedPlane(camera, Pose::Identity());
  // A turn about y shifts the image by the focal length times its tangent.
  const auto turnedBy = [&](double pixels) {
    Vector6d delta = Vector6d::Zero();
    delta[1] = std::atan(pixels / camera.fx);
    return GridOf(viewPoints(*cloud), camera, increment(delta));
  };
  EXPECT_TRUE(turnedBy(2).grid);
  const GridOf off = turnedBy(6);
  EXPECT_FALSE(off.grid);
  EXPECT_EQ(off.reason.find("the target's points project 6."), 0u) << off.reason;
  EXPECT_NE(
      off.reason.find(" px from their place in its grid; was it rendered at the virtual depth "
                      "pose?"),
      std::string::npos)
      << off.reason;
  Vector6d about = Vector6d::Zero();
  about[1] = M_PI;
  EXPECT_FALSE(GridOf(viewPoints(*cloud), camera, increment(about)).grid) << "behind the camera";
}

TEST(UnitNormals, CountWhereMostFinitePointsHaveThem)
{
  Cloud::Ptr cloud = renderedPlane(smallCamera(), Pose::Identity());
  const auto hasThem = [&] { return hasUnitNormals(viewPoints(*cloud)); };
  EXPECT_TRUE(hasThem());
  PointsView bare = viewPoints(*cloud);
  bare.normals = nullptr;
  EXPECT_FALSE(hasUnitNormals(bare));

  // Those of points that are not finite do not count.
  for (std::size_t i = 0; i < cloud->size() * 6 / 10; ++i) {
    (*cloud)[i].getNormalVector3fMap() *= 2;
    (*cloud)[i].x = std::nanf("");
  }
  EXPECT_TRUE(hasThem());
  for (std::size_t i = 0; i < cloud->size() * 6 / 10; ++i)
    (*cloud)[i].x = 0;
  EXPECT_FALSE(hasThem()) << "most are too long now";
  for (pcl::PointXYZRGBNormal& point : *cloud)
    point.getNormalVector3fMap().setZero();
  EXPECT_FALSE(hasThem()) << "as of a cloud whose normals nobody has computed";
}
