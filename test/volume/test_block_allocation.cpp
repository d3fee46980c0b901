// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "frame_fusion.h"

#include "volume/block_allocation.h"

#include <gtest/gtest.h>

#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Keys = std::set<std::uint64_t>;

const double VOXEL = coarseOptions().voxel_size, BLOCK = BLOCK_EDGE * VOXEL;

Keys
bandBlocks(const RGBDFrame& frame, const Pose& pose = Pose::Identity(),
           const TSDFOptions& options = coarseOptions())
{
  const auto keys = findBandBlocks(samplesOf(frame, options), pose, options, 1);
  return {keys.begin(), keys.end()};
}

/** The block of the voxel nearest to a point. */
std::uint64_t
keyAt(const Eigen::Vector3d& point)
{
  const Eigen::Vector3d voxel = (point / VOXEL).array().round();
  return VoxelBlockMap::key((voxel / BLOCK_EDGE).array().floor().cast<int>());
}

/** The cubes of its voxels. */
Eigen::AlignedBox3d
spaceOf(std::uint64_t key)
{
  const Eigen::Vector3d first = BLOCK * VoxelBlockMap::coordinates(key).cast<double>();
  return {first.array() - VOXEL / 2, first.array() + (BLOCK - VOXEL / 2)};
}

const Pose POSE = lookAt({0.31, -0.42, -0.83}, {0.02, 0.01, 0});

} // namespace

TEST(BlockAllocation, AFrontalWallTakesTwoLayers)
{
  // The band is from 0.96 to 1.04 m; layers begin at 0.955 and 1.035 m.
  const Keys keys = bandBlocks(flatFrame(1));
  const double tangent[] = {160 / 262.5, 120 / 262.5};
  for (const std::uint64_t key : keys) {
    const Eigen::AlignedBox3d space = spaceOf(key);
    const int z = VoxelBlockMap::coordinates(key).z();
    EXPECT_TRUE(z == 12 || z == 13);
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_LT(space.min()[axis], 1.04 * tangent[axis]);
      EXPECT_GT(space.max()[axis], -1.04 * tangent[axis]);
    }
  }
  for (int x = -7; x < 7; ++x)
    for (int y = -5; y < 5; ++y)
      for (const int z : {12, 13})
        EXPECT_TRUE(keys.count(VoxelBlockMap::key({x, y, z}))) << x << " " << y << " " << z;
}

TEST(BlockAllocation, HoldsTheBandOfEveryPixel)
{
  const RGBDFrame frame = render(sphere(0.3), POSE);
  const Keys keys = bandBlocks(frame, POSE);
  std::size_t found = 0, missing = 0;
  for (int v = 0; v < frame.depth.rows; ++v)
    for (int u = 0; u < frame.depth.cols; ++u)
      for (const double off : {-0.039, -0.02, 0.0, 0.02, 0.039}) {
        const double z = frame.depth.at<float>(v, u) + off;
        if (std::isnan(z))
          continue;
        const std::uint64_t key = keyAt(POSE * smallCamera().unproject(u, v, z));
        ++(keys.count(key) ? found : missing);
        // The surface itself is never missed.
        EXPECT_TRUE(off != 0 || keys.count(key)) << u << " " << v;
      }
  EXPECT_GT(found, 50000u);
  EXPECT_LT(double(missing), 0.001 * double(found)); // corners of blocks between two samples
}

TEST(BlockAllocation, TakesNoBlockOffTheBand)
{
  const Keys keys = bandBlocks(render(sphere(0.3), POSE), POSE);
  EXPECT_GT(keys.size(), 50u);
  for (const std::uint64_t key : keys) {
    // The band is 4 cm to each side along the optical axis.
    const Eigen::AlignedBox3d space = spaceOf(key);
    const double nearest = space.exteriorDistance(Eigen::Vector3d::Zero()),
                 farthest = space.center().norm() + 0.5 * space.diagonal().norm();
    EXPECT_LT(nearest, 0.35);
    EXPECT_GT(farthest, 0.25);
  }
}

TEST(BlockAllocation, FollowsTheWorldByWholeBlocks)
{
  const RGBDFrame frame = render(sphere(0.3), POSE);
  const Eigen::Vector3i shift(-30, 5, 1700);
  Keys shifted;
  for (const std::uint64_t key : bandBlocks(frame, POSE))
    shifted.insert(VoxelBlockMap::key(VoxelBlockMap::coordinates(key) + shift));
  EXPECT_EQ(bandBlocks(frame, Eigen::Translation3d(BLOCK * shift.cast<double>()) * POSE), shifted);
}

TEST(BlockAllocation, InARegionTakesTheBlocksThatReachIntoIt)
{
  const RGBDFrame frame = flatFrame(1);
  const Keys all = bandBlocks(frame);
  for (const double angle : {0.0, 0.7}) {
    TSDFOptions options = coarseOptions();
    options.region =
        OrientedBox(Pose(Eigen::Translation3d(0.1, -0.05, 1) *
                         Eigen::AngleAxisd(angle, Eigen::Vector3d(0.3, -0.2, 1).normalized())),
                    {0.7, 0.1, 0.3});
    // Touches a block when some place of a fine grid over it lies inside.
    OrientedBox larger = *options.region;
    larger.size.array() += 2 * VOXEL;
    const auto touches = [](std::uint64_t key, const OrientedBox& box) {
      bool found = false;
      const Eigen::Vector3d first = spaceOf(key).min();
      for (int i = 0; i < 9 * 9 * 9; ++i)
        found |= box.contains(first + VOXEL * Eigen::Vector3d(i % 9, i / 9 % 9, i / 81));
      return found;
    };
    const Keys part = bandBlocks(frame, Pose::Identity(), options);
    EXPECT_LT(part.size(), all.size() / 4);
    for (const std::uint64_t key : part)
      EXPECT_TRUE(all.count(key) && touches(key, larger));
    for (const std::uint64_t key : all)
      EXPECT_TRUE(part.count(key) || !touches(key, *options.region));
  }
}

TEST(BlockAllocation, WithoutDepthThereIsNone)
{
  EXPECT_TRUE(bandBlocks(flatFrame(NAN)).empty());
  EXPECT_TRUE(bandBlocks(flatFrame(6)).empty()); // beyond max_depth
  RGBDFrame lone = flatFrame(NAN);
  lone.depth.at<float>(120, 160) = 1; // a flying pixel
  EXPECT_TRUE(bandBlocks(lone).empty());
}

TEST(BlockAllocation, KeepsToTheSpaceThatKeysCanAddress)
{
  // Half of what the camera sees lies beyond the last block.
  const double end = BLOCK * VoxelBlockMap::limit;
  const Pose pose(Eigen::Translation3d(end, 0, 0));
  const Keys keys = bandBlocks(flatFrame(1), pose);
  EXPECT_GT(keys.size(), 50u);
  for (const std::uint64_t key : keys) {
    const int x = VoxelBlockMap::coordinates(key).x();
    EXPECT_GE(x, VoxelBlockMap::limit - 10);
    EXPECT_LE(x, VoxelBlockMap::limit - 2); // its neighbour has a key, too
  }
}

TEST(BlockAllocation, OrderDoesNotDependOnThreads)
{
  const DepthSamples samples = samplesOf(render(sphere(0.3), POSE));
  const auto one = findBandBlocks(samples, POSE, coarseOptions(), 1);
  EXPECT_FALSE(one.empty());
  EXPECT_EQ(findBandBlocks(samples, POSE, coarseOptions(), 3), one);
}
