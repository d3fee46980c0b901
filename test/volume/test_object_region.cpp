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

// A table 0.8 m above the world's z = 0, 1.2 x 0.8 m, with things of known size on it.
constexpr double table_height = 0.8;

Intersection
aligned(const Eigen::AlignedBox3d& box)
{
  return [box](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const Eigen::Array3d a = (box.min() - origin).array() / ray.array();
    const Eigen::Array3d b = (box.max() - origin).array() / ray.array();
    const double enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
    return enter > 0 && enter < leave ? enter : none;
  };
}

Intersection
nearestOf(const std::vector<Intersection>& parts)
{
  return [parts](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    double nearest = none;
    for (const Intersection& part : parts)
      if (const double t = part(origin, ray); t > 0 && !(t >= nearest))
        nearest = t;
    return nearest;
  };
}

const Intersection table = aligned(
    {Eigen::Vector3d(-0.6, -0.4, table_height - 0.03), Eigen::Vector3d(0.6, 0.4, table_height)});
const Eigen::AlignedBox3d wanted(Eigen::Vector3d(-0.1, -0.06, table_height),
                                 Eigen::Vector3d(0.1, 0.06, table_height + 0.15));
const Eigen::AlignedBox3d other(Eigen::Vector3d(0.35, 0.15, table_height),
                                Eigen::Vector3d(0.5, 0.3, table_height + 0.2));

struct Scan {
  std::vector<pcl::PointCloud<pcl::PointXYZ>> clouds;
  std::vector<Pose> poses;
};

// Frames from around that look at points near the middle of the table, in a world that
// new_from_table turns.
Scan
look(const Intersection& scene, const Eigen::Vector3d& at,
     const Pose& new_from_table = Pose::Identity())
{
  Scan scan;
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.8 * i;
    const Pose pose = lookAt({std::cos(angle), std::sin(angle), table_height + 0.7},
                             at + Eigen::Vector3d(0.01 * i, 0, 0));
    scan.clouds.push_back(samplePoints(render(scene, pose), smallCamera(), 2));
    scan.poses.push_back(new_from_table * pose);
  }
  return scan;
}

ObjectRegion
find(const Scan& scan, const ObjectRegionOptions& options = {})
{
  return findObjectRegion(scan.clouds, scan.poses, options);
}

// The box holds the object with the margin, give or take a cell.
void
expectAround(const OrientedBox& box, const Eigen::AlignedBox3d& object, const Pose& box_world)
{
  const ObjectRegionOptions options;
  const double tolerance = options.cell_size + 0.006;
  Eigen::Vector3d size = object.sizes();
  size.z() += options.margin; // below the plane
  Eigen::Vector3d wanted_size = size + Eigen::Vector3d(2, 2, 1) * options.margin;
  Eigen::Vector3d found_size = box.size;
  std::sort(wanted_size.data(), wanted_size.data() + 2);
  std::sort(found_size.data(), found_size.data() + 2);
  EXPECT_LT((found_size - wanted_size).cwiseAbs().maxCoeff(), 2 * tolerance)
      << found_size.transpose() << ", wanted " << wanted_size.transpose();
  for (int corner = 0; corner < 8; ++corner)
    EXPECT_TRUE(box.contains(box_world *
                             object.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))));
  const Eigen::Vector3d up = box_world.linear() * Eigen::Vector3d::UnitZ();
  EXPECT_GT(box.world_from_box.linear().col(2).dot(up), 0.999);
}

const Intersection things = nearestOf({table, aligned(wanted), aligned(other)});

std::string
refusal(const ObjectRegionOptions& options)
{
  return messageOf<pcl::BadArgumentException>(
      [&] { findObjectRegion({{}}, {Pose::Identity()}, options); });
}

} // namespace

TEST(ObjectRegion, IsTheThingOnTheTableThatFramesLookAt)
{
  const ObjectRegion first = find(look(things, wanted.center()));
  ASSERT_TRUE(first.is_found) << first.reason;
  expectAround(first.box, wanted, Pose::Identity());
  EXPECT_EQ(first.looking_frames, 8u);
  EXPECT_EQ(first.num_frames, 8u);
  EXPECT_LT((first.plane - Eigen::Vector4d(0, 0, 1, -table_height)).norm(), 0.01);

  const ObjectRegion second = find(look(things, other.center()));
  ASSERT_TRUE(second.is_found) << second.reason;
  expectAround(second.box, other, Pose::Identity());
}

TEST(ObjectRegion, FollowsTheWorldFrameAndNotTheOrderOfFrames)
{
  const Pose turned = Eigen::Translation3d(3, -2, 1) *
                      Pose(Eigen::AngleAxisd(2.1, Eigen::Vector3d(0.5, -0.7, 0.3).normalized()));
  Scan scan = look(things, wanted.center(), turned);
  const ObjectRegion region = find(scan);
  ASSERT_TRUE(region.is_found) << region.reason;
  expectAround(region.box, wanted, turned);

  std::reverse(scan.clouds.begin(), scan.clouds.end());
  std::reverse(scan.poses.begin(), scan.poses.end());
  const ObjectRegion reversed = find(scan);
  EXPECT_TRUE(reversed.box.size.isApprox(region.box.size, 1e-5));
  EXPECT_TRUE(reversed.box.world_from_box.isApprox(region.box.world_from_box, 1e-5));
}

TEST(ObjectRegion, SaysWhyThereIsNone)
{
  const ObjectRegion bare = find(look(table, {0, 0, table_height}));
  EXPECT_FALSE(bare.is_found);
  EXPECT_CONTAINS(bare.reason, "no object: nothing of 40 cells");

  Scan round;
  round.poses = posesAllAround(1.0);
  for (const Pose& pose : round.poses)
    round.clouds.push_back(samplePoints(render(sphere(0.3), pose), smallCamera(), 2));
  const ObjectRegion ball = find(round);
  EXPECT_FALSE(ball.is_found);
  EXPECT_CONTAINS(ball.reason, "no plane: the largest holds");

  Scan dark = look(things, wanted.center());
  for (auto& cloud : dark.clouds)
    cloud.clear();
  EXPECT_CONTAINS(find(dark).reason, "no plane: the largest holds 0 % of 0 points");

  // Things that only the rims of the images show
  ObjectRegionOptions narrow;
  narrow.view_angle = 0.02;
  EXPECT_CONTAINS(
      find(look(nearestOf({table, aligned(other)}), {-0.3, -0.2, table_height}), narrow).reason,
      "no object: no frame looks at any of the");
}

TEST(ObjectRegion, IgnoresWhatLiesBesideThePlane)
{
  // A pillar beside the table, taller than all on it
  const Intersection pillar =
      aligned({Eigen::Vector3d(0.7, -0.1, 0), Eigen::Vector3d(0.9, 0.1, 1.3)});
  const ObjectRegion region = find(look(nearestOf({things, pillar}), {0.5, 0.05, table_height}));
  ASSERT_TRUE(region.is_found) << region.reason;
  EXPECT_FALSE(region.box.contains({0.8, 0, 1.2}));
}

TEST(ObjectRegion, RefusesBadArguments)
{
  const auto changed = [](auto change) {
    ObjectRegionOptions options;
    change(options);
    return refusal(options);
  };
  EXPECT_CONTAINS(changed([](auto& o) { o.cell_size = 0; }), "cell_size 0; expected 0.001 to 0.1");
  EXPECT_CONTAINS(changed([](auto& o) { o.max_depth = NAN; }), "max_depth nan");
  EXPECT_CONTAINS(changed([](auto& o) { o.plane_tolerance = 1; }), "plane_tolerance 1");
  EXPECT_CONTAINS(changed([](auto& o) { o.min_plane_share = 2; }), "min_plane_share 2");
  EXPECT_CONTAINS(changed([](auto& o) { o.min_height = 0; }), "min_height 0");
  EXPECT_CONTAINS(changed([](auto& o) { o.max_height = 200; }), "max_height 200");
  EXPECT_CONTAINS(changed([](auto& o) { o.cluster_tolerance = 1; }), "cluster_tolerance 1");
  EXPECT_CONTAINS(changed([](auto& o) { o.min_cells = 0; }), "min_cells 0");
  EXPECT_CONTAINS(changed([](auto& o) { o.view_angle = 3; }), "view_angle 3");
  EXPECT_CONTAINS(changed([](auto& o) { o.margin = -1; }), "margin -1");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] { findObjectRegion({}, {}); }),
                  "0 clouds and 0 poses");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] { findObjectRegion({{}}, {}); }),
                  "1 clouds and 0 poses");
  Pose bad = Pose::Identity();
  bad.translation().x() = NAN;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { findObjectRegion({{}}, {bad}); }),
                  "pose 0 is not a rigid motion");
}
