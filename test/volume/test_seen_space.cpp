// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/rendered_frame.h"
#include "volume/seen_space.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double CELL = 0.05;

const Eigen::AlignedBox3d BOX(Eigen::Vector3d(-1, -1, -0.5), Eigen::Vector3d(1, 1, 3));

/** What a camera at the origin that looks at a wall 2 m away has seen. */
SeenSpace
wallSeen(int num_threads = 0)
{
  SeenSpace space(BOX, CELL);
  space.look(render(plane({0, 0, 1}, 2), Pose::Identity()).depth, smallCamera(), Pose::Identity(),
             num_threads);
  return space;
}

} // namespace

TEST(SeenSpace, IsFreeBeforeASurfaceAndUnseenBehindAndBeside)
{
  const SeenSpace space = wallSeen();
  for (double z = 0.3; z < 1.85; z += 0.1)
    EXPECT_EQ(space.at({0.1 * z, -0.1 * z, z}), Seen::FREE) << z;
  EXPECT_EQ(space.at({0, 0, 2}), Seen::SURFACE);
  EXPECT_EQ(space.at({0, 0, 2.2}), Seen::NOTHING);
  EXPECT_EQ(space.at({0.9, 0, 1}), Seen::NOTHING); // outside of the image
  EXPECT_EQ(space.at({0, 0, -0.2}), Seen::NOTHING);
  EXPECT_EQ(space.at({0, 0, 30}), Seen::NOTHING); // outside of the box
}

TEST(SeenSpace, PixelsWithoutDepthSayNothing)
{
  SeenSpace space(BOX, CELL);
  cv::Mat depth = render(plane({0, 0, 1}, 2), Pose::Identity()).depth;
  depth.colRange(0, depth.cols / 2).setTo(none);
  space.look(depth, smallCamera(), Pose::Identity(), 0);
  EXPECT_EQ(space.at({-0.3, 0, 1}), Seen::NOTHING);
  EXPECT_EQ(space.at({-0.3, 0, 2}), Seen::NOTHING);
  EXPECT_EQ(space.at({0.3, 0, 1}), Seen::FREE);
}

TEST(SeenSpace, DoesNotDependOnOrderAndThreads)
{
  const std::vector<Pose> poses = posesAllAround(0.9);
  SeenSpace one(BOX, CELL), other(BOX, CELL);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose& last = poses[poses.size() - 1 - i];
    one.look(render(sphere(0.3), poses[i]).depth, smallCamera(), poses[i], 1);
    other.look(render(sphere(0.3), last).depth, smallCamera(), last, 4);
  }
  std::size_t free = 0;
  for (std::size_t cell = 0; cell < one.numCells(); ++cell) {
    ASSERT_EQ(one[cell], other[cell]);
    free += one[cell] == Seen::FREE;
    const double radius = one.center(cell).norm();
    if (radius < 0.2) {
      ASSERT_NE(one[cell], Seen::FREE); // inside of the sphere
    }
  }
  EXPECT_GT(free, 100u);
}

TEST(SeenSpace, MeshIsSurfaceAndCamerasStandInFreeSpace)
{
  SeenSpace space = wallSeen();
  space.stand({0, 0, -0.2}, 0.1);
  EXPECT_EQ(space.at({0, 0, -0.2}), Seen::FREE);
  EXPECT_EQ(space.at({0, 0.05, -0.2}), Seen::FREE);
  SurfaceMesh mesh; // one large triangle across free space
  mesh.vertices = {{-0.5f, -0.5f, 1}, {0.5f, -0.5f, 1}, {0, 0.5f, 1}};
  mesh.triangles = {{0, 1, 2}};
  space.addSurface(mesh);
  std::size_t met = 0;
  for (int i = -5; i <= 5; ++i) // no ray slips through
    space.walk({0, 0, 0.5}, Eigen::Vector3d(0.04 * i, -0.012 * i, 1).normalized(), 1,
               [&](std::size_t cell, double) {
                 met += space[cell] == Seen::SURFACE;
                 return space[cell] != Seen::SURFACE;
               });
  EXPECT_EQ(met, 11u);
}

TEST(SeenSpace, ARayVisitsTheCellsOnItsWayInOrder)
{
  const SeenSpace space(BOX, CELL);
  const Eigen::Vector3d origin(-0.7, 0.3, 0.1),
      direction = Eigen::Vector3d(1, -0.7, 1.6).normalized();
  double last = -1;
  std::vector<std::size_t> cells;
  space.walk(origin, direction, 1, [&](std::size_t cell, double distance) {
    EXPECT_GE(distance, last);
    last = distance;
    EXPECT_LT((space.center(cell) - (origin + distance * direction)).cwiseAbs().maxCoeff(),
              CELL / 2 + 1e-9);
    cells.push_back(cell);
    return true;
  });
  for (double distance = 0; distance < 1; distance += CELL / 20) {
    const auto cell = space.find(origin + distance * direction);
    ASSERT_TRUE(cell);
    EXPECT_NE(std::find(cells.begin(), cells.end(), *cell), cells.end()) << distance;
  }
}

TEST(SeenSpace, CellsGrowWithTheScan)
{
  const SeenSpace space({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(200)}, 0.02);
  EXPECT_LE(double(space.numCells()), SeenSpace::MAX_CELLS);
  EXPECT_GT(space.cellSize(), 0.5);
}
