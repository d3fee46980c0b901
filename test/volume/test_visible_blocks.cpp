// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "frame_fusion.h"
#include "variants.h"

#include "volume/visible_blocks.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const double BLOCK = BLOCK_EDGE * coarseOptions().voxel_size;

VoxelBlockMap
blocksAt(const std::vector<Eigen::Vector3i>& places, bool may_hold_surface)
{
  VoxelBlockMap blocks;
  for (const Eigen::Vector3i& place : places) {
    blocks.insert(VoxelBlockMap::key(place));
    if (may_hold_surface)
      blocks.setMayHoldSurface(blocks.size() - 1);
  }
  return blocks;
}

std::vector<VisibleBlock>
visible(const VoxelBlockMap& blocks, const DepthSamples& samples,
        const Pose& world_from_camera = Pose::Identity(), int num_threads = 1)
{
  return findVisibleBlocks(blocks, samples, world_from_camera.inverse(), coarseOptions(),
                           num_threads);
}

std::vector<std::uint32_t>
numbersOf(const std::vector<VisibleBlock>& blocks)
{
  std::vector<std::uint32_t> numbers;
  for (const VisibleBlock& block : blocks)
    numbers.push_back(block.number);
  return numbers;
}

/** A cube of blocks around the origin. */
std::vector<Eigen::Vector3i>
cube(int half)
{
  std::vector<Eigen::Vector3i> places;
  for (int z = -half; z < half; ++z)
    for (int y = -half; y < half; ++y)
      for (int x = -half; x < half; ++x)
        places.emplace_back(x, y, z);
  return places;
}

/** A ball in front of a wall with noise, and pixels without depth. */
RGBDFrame
noisyBall(const Pose& pose)
{
  RGBDFrame frame = render(sphere(0.2), pose);
  std::mt19937 random(8);
  std::normal_distribution<float> noise(0, 0.002f);
  for (auto z = frame.depth.begin<float>(); z != frame.depth.end<float>(); ++z)
    *z = (*z > 0 ? *z : 1.15f) + noise(random);
  frame.depth(cv::Rect(100, 60, 30, 90)).setTo(NAN);
  return frame;
}

} // namespace

TEST(VisibleBlocks, OfAWallAreThoseInItsBandOnly)
{
  // Blocks of 8 cm along the optical axis, whose voxels lie up to 7 cm behind the first.
  std::vector<Eigen::Vector3i> places;
  for (int z = 1; z < 20; ++z)
    places.emplace_back(0, 0, z);
  const VoxelBlockMap blocks = blocksAt(places, false);
  for (const double wall : {0.985, 1.005, 1.025, 1.045}) {
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < places.size(); ++i)
      if (0.08 * (i + 1) < wall + 0.04 && 0.08 * (i + 1) + 0.07 > wall - 0.04)
        expected.push_back(i);
    const std::vector<VisibleBlock> found = visible(blocks, samplesOf(flatFrame(float(wall))));
    EXPECT_EQ(numbersOf(found), expected) << wall;
    for (const VisibleBlock& block : found)
      EXPECT_FLOAT_EQ(block.farthest, float(wall + 0.04));
  }
}

TEST(VisibleBlocks, InFreeSpaceAreThoseThatMayHoldASurface)
{
  std::vector<Eigen::Vector3i> places;
  for (int z = 1; z < 20; ++z)
    places.emplace_back(0, 0, z);
  const auto found = numbersOf(visible(blocksAt(places, true), samplesOf(flatFrame(1.01f))));
  ASSERT_EQ(found.size(), 13u);
  EXPECT_EQ(found.front(), 0u);
  EXPECT_EQ(found.back(), 12u);
}

TEST(VisibleBlocks, AreNoneOutsideOfTheViewOrWithoutDepth)
{
  const VoxelBlockMap outside =
      blocksAt({{0, 0, -12}, {12, 0, 12}, {-12, 0, 12}, {0, 8, 12}, {0, -8, 12}}, true);
  EXPECT_TRUE(visible(outside, samplesOf(flatFrame(1))).empty());
  const VoxelBlockMap inside = blocksAt(cube(3), true);
  EXPECT_TRUE(visible(inside, samplesOf(flatFrame(NAN))).empty());
  EXPECT_TRUE(visible({}, samplesOf(flatFrame(1))).empty());
}

TEST(VisibleBlocks, OneThatTheCameraIsInIsVisible)
{
  const VoxelBlockMap home = blocksAt({{0, 0, 0}}, true);
  const Pose pose = lookAt({0.04, 0.04, -0.04}, {0.04, 0.04, 1});
  EXPECT_EQ(visible(home, samplesOf(flatFrame(1)), pose).size(), 1u);
}

TEST(VisibleBlocks, TheOthersWouldNotChange)
{
  const std::vector<Eigen::Vector3i> places = cube(6);
  std::size_t hidden = 0, seen = 0;
  for (const Pose& pose : posesAllAround(0.7)) {
    const FrameFusion frame(noisyBall(pose), coarseOptions(), {}, pose);
    const VoxelBlockMap blocks = blocksAt(places, true);
    const std::vector<VisibleBlock> found = visible(blocks, frame.samples, pose);
    std::vector<float> farthest(places.size(), 0);
    for (const VisibleBlock& block : found)
      farthest[block.number] = block.farthest;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector3d corner = BLOCK * places[i].cast<double>();
      VoxelBlock all{}, part{};
      frame.fuse(corner, all);
      if (farthest[i] > 0)
        frame.fuse(corner, part, 1, farthest[i]);
      ASSERT_TRUE(areEqual(all, part)) << places[i].transpose();
      ++(areEqual(all, VoxelBlock{}) ? hidden : seen);
    }
  }
  EXPECT_GT(hidden, 3000u);
  EXPECT_GT(seen, 3000u);
}

TEST(VisibleBlocks, WithoutSurfaceSoFarTheOthersWouldGetNone)
{
  const std::vector<Eigen::Vector3i> places = cube(6);
  const Pose pose = lookAt({0.4, -0.3, 0.5}, {0, 0, 0});
  const FrameFusion frame(noisyBall(pose), coarseOptions(), {}, pose);
  const auto found = numbersOf(visible(blocksAt(places, false), frame.samples, pose));
  EXPECT_LT(found.size(), places.size() / 2);
  std::size_t behind = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    VoxelBlock block{};
    if (!frame.fuse(BLOCK * places[i].cast<double>(), block))
      continue;
    ++behind;
    EXPECT_TRUE(std::binary_search(found.begin(), found.end(), i)) << places[i].transpose();
  }
  EXPECT_GT(behind, 50u);
}

TEST(VisibleBlocks, AreTheSameForAnyNumberOfThreads)
{
  const VoxelBlockMap blocks = blocksAt(cube(6), true);
  const Pose pose = lookAt({0.4, -0.3, 0.5}, {0, 0, 0});
  const DepthSamples samples = samplesOf(noisyBall(pose));
  const auto one = visible(blocks, samples, pose, 1), three = visible(blocks, samples, pose, 3);
  EXPECT_EQ(numbersOf(one), numbersOf(three));
  for (std::size_t i = 0; i < one.size(); ++i)
    EXPECT_EQ(one[i].farthest, three[i].farthest);
}
