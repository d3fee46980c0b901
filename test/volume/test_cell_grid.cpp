// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/cell_grid.h"

#include <gtest/gtest.h>

#include <random>

using namespace bundle_icp;

namespace {

using Cloud = CellGrid::Cloud;

const std::vector<Pose> TWICE(2, Pose::Identity());

// Cells of 10 cm.
ObjectRegionOptions
wideCells()
{
  ObjectRegionOptions options;
  options.cell_size = 0.1;
  return options;
}

Cloud
cloudOf(std::initializer_list<Eigen::Vector3f> points)
{
  Cloud cloud;
  for (const Eigen::Vector3f& p : points)
    cloud.push_back({p.x(), p.y(), p.z()});
  return cloud;
}

Cloud
randomCloud(unsigned seed)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-0.4f, 0.4f);
  Cloud cloud;
  for (int i = 0; i < 2000; ++i)
    cloud.push_back({uniform(random), uniform(random), 1 + uniform(random)});
  return cloud;
}

} // namespace

TEST(CellGrid, ACentreIsTheMeanOfItsPoints)
{
  const CellGrid grid(
      {cloudOf({{0.01f, 0.02f, 1.03f}, {0.05f, 0.08f, 1.01f}}), cloudOf({{0.09f, 0.05f, 1.02f}})},
      TWICE, wideCells());
  ASSERT_EQ(grid.centers->size(), 1u);
  EXPECT_TRUE((*grid.centers)[0].getVector3fMap().isApprox(Eigen::Vector3f(0.05f, 0.05f, 1.02f)));
  EXPECT_EQ(grid.at({0.001, 0.099, 1.05}), 0);
  EXPECT_EQ(grid.at({-0.001, 0.05, 1.05}), -1);
  EXPECT_EQ(grid.at({0.05, 0.05, 1.101}), -1);
}

TEST(CellGrid, WhatOneFrameAloneSeesDoesNotCount)
{
  const Cloud both = cloudOf({{0.05f, 0, 1}}),
              alone = cloudOf({{0.05f, 0, 1}, {0.55f, 0, 1}, {0.56f, 0, 1}});
  const CellGrid grid({both, alone}, TWICE, wideCells());
  EXPECT_EQ(grid.centers->size(), 1u);
  EXPECT_EQ(grid.at({0.55, 0, 1}), -1);
  // Unless there is no other frame.
  EXPECT_EQ(CellGrid({alone}, {Pose::Identity()}, wideCells()).centers->size(), 2u);
}

TEST(CellGrid, FarAndMissingPointsAreLeftOut)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const ObjectRegionOptions options = wideCells(); // max_depth 3 m
  const Cloud cloud =
      cloudOf({{0, 0, 2.99f}, {0, 0, 3.01f}, {2.5f, 0, 2.5f}, {nan, 0, 1}, {0, 0, nan}});
  const CellGrid grid({cloud, cloud}, TWICE, options);
  ASSERT_EQ(grid.centers->size(), 1u);
  EXPECT_FLOAT_EQ((*grid.centers)[0].z, 2.99f);
}

TEST(CellGrid, PosesBringPointsIntoTheWorld)
{
  // The same point of the world, seen from two places.
  const Pose first(Eigen::Translation3d(0, 0, -1));
  const Pose second =
      Eigen::Translation3d(1, 0, 0) * Pose(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d point(0.05, 0.05, 0.05);
  std::vector<Cloud> clouds;
  for (const Pose& pose : {first, second})
    clouds.push_back(cloudOf({(pose.inverse() * point).cast<float>()}));
  const CellGrid grid(clouds, {first, second}, wideCells());
  ASSERT_EQ(grid.centers->size(), 1u);
  EXPECT_TRUE((*grid.centers)[0].getVector3fMap().isApprox(point.cast<float>(), 1e-5f));
}

TEST(CellGrid, DoesNotDependOnTheOrderOfFrames)
{
  const std::vector<Cloud> clouds{randomCloud(1), randomCloud(2), randomCloud(3)};
  const std::vector<Pose> poses(3, Pose::Identity());
  const CellGrid forward(clouds, poses, wideCells());
  const CellGrid backward({clouds[2], clouds[1], clouds[0]}, poses, wideCells());
  ASSERT_EQ(forward.centers->size(), backward.centers->size());
  EXPECT_GE(forward.centers->size(), 8u * 8u * 8u);
  for (std::size_t i = 0; i < forward.centers->size(); ++i)
    EXPECT_TRUE((*forward.centers)[i].getVector3fMap().isApprox(
        (*backward.centers)[i].getVector3fMap(), 1e-6f));
}

TEST(CellGrid, EveryCentreLiesInItsOwnCell)
{
  const CellGrid grid({randomCloud(1), randomCloud(2)}, TWICE, wideCells());
  for (std::size_t i = 0; i < grid.centers->size(); ++i)
    ASSERT_EQ(grid.at((*grid.centers)[i].getVector3fMap().cast<double>()), int(i));
}

TEST(CellGrid, WeightedPointsCountCellsByTheirPoints)
{
  Cloud cloud;
  for (int i = 0; i < 3000; ++i)
    cloud.push_back({i < 2000 ? 0.05f : 0.55f, 0.05f, 1.05f});
  const CellGrid grid({cloud, cloud}, TWICE, wideCells());
  EXPECT_EQ(grid.weightedPoints(100000)->size(), 6000u);
  const Cloud::Ptr thinned = grid.weightedPoints(600);
  EXPECT_NEAR(double(thinned->size()), 600, 1);
  const auto left = std::count_if(thinned->begin(), thinned->end(),
                                  [](const pcl::PointXYZ& point) { return point.x < 0.3f; });
  EXPECT_NEAR(double(left), 400, 1);
  EXPECT_TRUE(CellGrid({Cloud()}, {Pose::Identity()}, wideCells()).weightedPoints(10)->empty());
}
