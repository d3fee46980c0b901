// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "rendered_frame.h"

#include "volume/ray_range.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

TSDFVolume::Impl
volumeWith(const std::vector<Eigen::Vector3i>& blocks, double voxel_size = 0.01)
{
  TSDFVolume::Impl volume;
  volume.options.voxel_size = voxel_size;
  for (const Eigen::Vector3i& block : blocks) {
    volume.blocks.insert(VoxelBlockMap::key(block));
    volume.blocks.setMayHoldSurface(volume.blocks.size() - 1);
  }
  return volume;
}

RayRanges
rangesOf(const TSDFVolume::Impl& volume, const Pose& camera_from_world = Pose::Identity())
{
  return {volume, smallCamera(), camera_from_world};
}

bool
isEmpty(const RayRanges::Range& range)
{
  return range.near > range.far;
}

std::size_t
numFilled(const RayRanges& ranges)
{
  std::size_t count = 0;
  for (int y = 0; y < smallCamera().height; ++y)
    for (int x = 0; x < smallCamera().width; ++x)
      count += !isEmpty(ranges.at(x, y));
  return count;
}

} // namespace

TEST(RayRanges, OfABlockAreItsDepthsWithAVoxelMore)
{
  // Voxels 96 to 103 along z, 0 to 7 across.
  const TSDFVolume::Impl volume = volumeWith({{0, 0, 12}});
  const RayRanges ranges = rangesOf(volume);
  // From 1 cm left of the axis to 8 cm right of it, at 0.95 m: columns 156.7 to 181.6, rows
  // 116.7 to 141.6, rounded to tiles of 8.
  for (const int x : {152, 183})
    for (const int y : {112, 143}) {
      EXPECT_FLOAT_EQ(ranges.at(x, y).near, 0.95f);
      EXPECT_FLOAT_EQ(ranges.at(x, y).far, 1.04f);
    }
  EXPECT_EQ(numFilled(ranges), 32u * 32u);
}

TEST(RayRanges, OfTwoBlocksReachFromTheFirstToTheLast)
{
  const RayRanges ranges = rangesOf(volumeWith({{0, 0, 25}, {0, 0, 12}}));
  EXPECT_FLOAT_EQ(ranges.at(162, 122).near, 0.95f);
  EXPECT_FLOAT_EQ(ranges.at(162, 122).far, 2.08f);
  // The nearer one shows more of itself.
  EXPECT_FLOAT_EQ(ranges.at(180, 140).far, 1.04f);
}

TEST(RayRanges, HoldEveryVoxelThatThePixelsSee)
{
  const CameraIntrinsics camera = smallCamera();
  std::vector<Eigen::Vector3i> blocks;
  std::mt19937 random(3);
  std::uniform_int_distribution<int> place(-4, 4);
  for (int i = 0; i < 40; ++i)
    blocks.emplace_back(place(random), place(random), place(random));
  const TSDFVolume::Impl volume = volumeWith(blocks, 0.02);
  std::size_t seen = 0;
  for (const Pose& pose : posesAllAround(0.9)) {
    const Pose camera_from_world = pose.inverse();
    const RayRanges ranges = rangesOf(volume, camera_from_world);
    for (const Eigen::Vector3i& block : blocks)
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i side(corner & 1, corner >> 1 & 1, corner >> 2);
        const Eigen::Vector3i voxel = BLOCK_EDGE * block + (BLOCK_EDGE - 1) * side;
        const Eigen::Vector3d p = camera_from_world * (0.02 * voxel.cast<double>());
        if (p.z() < 0.06 || !camera.contains(camera.project(p)))
          continue;
        const Eigen::Vector2i pixel = camera.project(p).array().round().cast<int>();
        const RayRanges::Range range = ranges.at(pixel.x(), pixel.y());
        ASSERT_LE(range.near, p.z());
        ASSERT_GE(range.far, p.z());
        ++seen;
      }
  }
  EXPECT_GT(seen, 1000u);
}

TEST(RayRanges, AreEmptyWithoutSurfaceInView)
{
  EXPECT_EQ(numFilled(rangesOf(volumeWith({}))), 0u);
  // Behind the camera, left of the image and below it
  EXPECT_EQ(numFilled(rangesOf(volumeWith({{0, 0, -12}, {-20, 0, 12}, {0, 20, 12}}))), 0u);
  // In view, but free
  TSDFVolume::Impl free = volumeWith({});
  free.blocks.insert(VoxelBlockMap::key({0, 0, 12}));
  EXPECT_EQ(numFilled(rangesOf(free)), 0u);
}

TEST(RayRanges, ABlockAroundTheCameraFillsTheImage)
{
  // Voxels from 0 to 0.7 m along each axis, and one more to each side
  const Pose camera_from_world(Eigen::Translation3d(-0.35, -0.35, -0.35));
  const RayRanges ranges = rangesOf(volumeWith({{0, 0, 0}}, 0.1), camera_from_world);
  const CameraIntrinsics camera = smallCamera();
  EXPECT_EQ(numFilled(ranges), std::size_t(camera.width * camera.height));
  EXPECT_LE(ranges.at(0, 0).near, 0.05f);
  EXPECT_NEAR(ranges.at(0, 0).far, 0.45, 1e-5);
}

TEST(RayRanges, CoverImagesThatTilesDoNotDivide)
{
  CameraIntrinsics camera = smallCamera();
  camera.width = 317;
  camera.height = 235;
  const TSDFVolume::Impl volume = volumeWith({{0, 0, 0}}, 0.1);
  const RayRanges ranges(volume, camera, Pose(Eigen::Translation3d(-0.35, -0.35, -0.35)));
  EXPECT_FALSE(isEmpty(ranges.at(316, 234)));
  EXPECT_FALSE(isEmpty(ranges.at(316, 0)));
}
