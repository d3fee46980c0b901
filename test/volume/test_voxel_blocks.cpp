// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/voxel_blocks.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

using namespace bundle_icp;

TEST(VoxelBlocks, KeysHoldCoordinatesToTheEndsOfTheSpace)
{
  constexpr int first = -VoxelBlockMap::limit, last = VoxelBlockMap::limit - 1;
  std::set<std::uint64_t> keys;
  for (const int x : {first, -1, 0, 7, last})
    for (const int y : {first, -1, 0, 7, last})
      for (const int z : {first, -1, 0, 7, last}) {
        const std::uint64_t key = VoxelBlockMap::key({x, y, z});
        EXPECT_EQ(VoxelBlockMap::coordinates(key), Eigen::Vector3i(x, y, z));
        keys.insert(key);
      }
  EXPECT_EQ(keys.size(), 125u);
}

TEST(VoxelBlocks, KeysAreOrderedByZThenYThenX)
{
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(-3, 3);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3i a(place(random), place(random), place(random)),
        b(place(random), place(random), place(random));
    EXPECT_EQ(VoxelBlockMap::key(a) < VoxelBlockMap::key(b),
              std::make_tuple(a.z(), a.y(), a.x()) < std::make_tuple(b.z(), b.y(), b.x()));
  }
}

TEST(VoxelBlocks, AreNumberedInTheOrderOfInsertionAndOnce)
{
  VoxelBlockMap blocks;
  const Eigen::Vector3i far(5, -6, 7), near(0, 0, 0), absent(0, 0, 1);
  for (const Eigen::Vector3i& block : {far, near, far, near})
    blocks.insert(VoxelBlockMap::key(block));
  EXPECT_EQ(blocks.size(), 2u);
  EXPECT_EQ(blocks.indexOf(far), 0);
  EXPECT_EQ(blocks.indexOf(near), 1);
  EXPECT_EQ(blocks.indexOf(absent), -1);
  EXPECT_EQ(blocks.coordinatesOf(0), far);
  EXPECT_EQ(blocks.find(near), &blocks[1]);
  EXPECT_EQ(blocks.find(absent), nullptr);
}

TEST(VoxelBlocks, NeverMoveAndStartAsZeros)
{
  VoxelBlockMap blocks;
  std::vector<const VoxelBlock*> places;
  constexpr int count = 1000; // several chunks
  for (int i = 0; i < count; ++i) {
    blocks.insert(VoxelBlockMap::key({i, 0, 0}));
    VoxelBlock& block = blocks[i];
    for (int voxel = 0; voxel < BLOCK_VOXELS; ++voxel)
      ASSERT_TRUE(block.distance[voxel] == 0 && block.weight[voxel] == 0 &&
                  block.color[voxel] == 0);
    block.weight[BLOCK_VOXELS - 1] = std::uint16_t(i);
    places.push_back(&block);
  }
  for (int i = 0; i < count; ++i) {
    ASSERT_EQ(blocks.find({i, 0, 0}), places[i]);
    ASSERT_EQ(places[i]->weight[BLOCK_VOXELS - 1], i);
    ASSERT_EQ(reinterpret_cast<std::uintptr_t>(places[i]) % alignof(VoxelBlock), 0u);
  }
}

TEST(VoxelBlocks, SurfaceIsMarkedBlockByBlock)
{
  VoxelBlockMap blocks;
  for (int i = 0; i < 3; ++i)
    blocks.insert(VoxelBlockMap::key({i, 0, 0}));
  blocks.setMayHoldSurface(1);
  EXPECT_FALSE(blocks.mayHoldSurface(0));
  EXPECT_TRUE(blocks.mayHoldSurface(1));
  blocks.insert(VoxelBlockMap::key({1, 0, 0}));
  EXPECT_TRUE(blocks.mayHoldSurface(1));
  EXPECT_FALSE(blocks.mayHoldSurface(2));
}

TEST(VoxelBlocks, MemoryIsThatOfTheVoxelsAndLittleMore)
{
  VoxelBlockMap blocks;
  const std::size_t empty = blocks.memoryBytes();
  constexpr int count = 2048;
  for (int i = 0; i < count; ++i)
    blocks.insert(VoxelBlockMap::key({0, i, 0}));
  constexpr std::size_t voxels = std::size_t(count) * BLOCK_VOXELS * 8;
  EXPECT_EQ(sizeof(VoxelBlock), BLOCK_VOXELS * 8u);
  EXPECT_GE(blocks.memoryBytes() - empty, voxels);
  EXPECT_LT(double(blocks.memoryBytes() - empty), 1.02 * voxels);
}

TEST(VoxelBlocks, WeightsKeepElevenBitsFromFarToManyNearMeasurements)
{
  EXPECT_EQ(decodeWeight(0), 0);
  EXPECT_EQ(decodeWeight(14 << 11), 1);
  EXPECT_EQ(decodeWeight(15 << 11), 2);
  EXPECT_LT(decodeWeight(1), 6.2e-5f);
  EXPECT_GT(decodeWeight(65535), 262000);
  for (int code = 1; code < 65535; ++code) {
    const float here = decodeWeight(std::uint16_t(code)),
                next = decodeWeight(std::uint16_t(code + 1));
    ASSERT_GT(next, here);
    ASSERT_LE(next, here * (1 + 1.0f / 2048));
  }
}

TEST(VoxelBlocks, ColorsReachFromBlackToWhite)
{
  EXPECT_EQ(decodeColor(LARGEST_COLOR_WEIGHT), Eigen::Vector3f(0, 0, 0));
  EXPECT_TRUE(decodeColor(~0u).isApprox(Eigen::Vector3f(255, 255, 255)));
  EXPECT_TRUE(decodeColor(511u << RED_SHIFT).isApprox(Eigen::Vector3f(255, 0, 0)));
  EXPECT_TRUE(decodeColor(511u << GREEN_SHIFT).isApprox(Eigen::Vector3f(0, 255, 0)));
  EXPECT_TRUE(decodeColor(255u << BLUE_SHIFT).isApprox(Eigen::Vector3f(0, 0, 255)));
}
