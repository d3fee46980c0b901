// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "voxel_field.h"

#include "volume/voxel_sampler.h"

#include <gtest/gtest.h>

#include <random>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const Eigen::Vector3d SLOPE(0.02, -0.013, 0.031);

// Blocks from (-1, -1, -1) to (0, 0, 0): voxels from -8 to 7.
TSDFVolume::Impl
volumeOf(const Field& field)
{
  TSDFVolume::Impl volume;
  fillBlocks({-1, -1, -1}, {0, 0, 0}, field, volume.blocks);
  return volume;
}

TSDFVolume::Impl
linearVolume()
{
  return volumeOf([](const Eigen::Vector3i& voxel) { return SLOPE.dot(voxel.cast<double>()); });
}

/** Places at which all eight voxels, `margin` farther, are there. */
std::vector<Eigen::Vector3f>
places(float margin)
{
  std::mt19937 random(4);
  std::uniform_real_distribution<float> uniform(-8 + margin, 7 - margin);
  std::vector<Eigen::Vector3f> result;
  for (int i = 0; i < 500; ++i)
    result.emplace_back(uniform(random), uniform(random), uniform(random));
  return result;
}

constexpr float DIGIT = 1 / DISTANCE_SCALE;

} // namespace

TEST(VoxelSampler, ALinearFieldIsExactBetweenVoxelsAndAcrossBlocks)
{
  const TSDFVolume::Impl volume = linearVolume();
  VoxelSampler sampler(volume);
  for (const Eigen::Vector3f& place : places(0)) {
    const auto distance = sampler.distance(place);
    ASSERT_TRUE(distance.has_value()) << place.transpose();
    EXPECT_NEAR(*distance, SLOPE.dot(place.cast<double>()), DIGIT) << place.transpose();
    const Eigen::Vector3i cell = place.array().floor().cast<int>();
    EXPECT_EQ(sampler.distance(cell, place - cell.cast<float>()), distance);
  }
}

TEST(VoxelSampler, TheGradientOfALinearFieldIsItsSlopePerVoxel)
{
  const TSDFVolume::Impl volume = linearVolume();
  VoxelSampler sampler(volume);
  for (const Eigen::Vector3f& place : places(1)) {
    const auto gradient = sampler.gradient(place);
    ASSERT_TRUE(gradient.has_value()) << place.transpose();
    EXPECT_LT((gradient->cast<double>() - SLOPE).cwiseAbs().maxCoeff(), DIGIT);
  }
  // A voxel farther ahead is not there.
  EXPECT_FALSE(sampler.gradient({6.5f, 0, 0}).has_value());
}

TEST(VoxelSampler, BetweenVoxelsAProductOfAxesIsExact)
{
  // The trilinear interpolant holds all products of the three coordinates.
  const auto product = [](const Eigen::Vector3d& p) {
    return 0.3 + 0.001 * p.x() * p.y() * p.z() - 0.002 * p.x() * p.z();
  };
  const TSDFVolume::Impl volume =
      volumeOf([&](const Eigen::Vector3i& voxel) { return product(voxel.cast<double>()); });
  VoxelSampler sampler(volume);
  for (const Eigen::Vector3f& place : places(0))
    EXPECT_NEAR(sampler.distance(place).value(), product(place.cast<double>()), DIGIT);
}

TEST(VoxelSampler, OneUnseenVoxelSpoilsTheEightCellsAroundIt)
{
  TSDFVolume::Impl volume = linearVolume();
  const Eigen::Vector3i unseen(-1, 0, 3);
  blockOf(unseen, volume.blocks).weight[placeOf(unseen)] = 0;
  VoxelSampler sampler(volume);
  int spoilt = 0;
  for (int z = -8; z < 7; ++z)
    for (int y = -8; y < 7; ++y)
      for (int x = -8; x < 7; ++x) {
        const Eigen::Vector3i cell(x, y, z);
        const bool touches = ((unseen - cell).array() >= 0).all() && (unseen - cell).maxCoeff() < 2;
        const Eigen::Vector3f middle = cell.cast<float>() + Eigen::Vector3f::Constant(0.5f);
        ASSERT_EQ(sampler.distance(middle).has_value(), !touches) << cell.transpose();
        spoilt += touches;
      }
  EXPECT_EQ(spoilt, 8);
  EXPECT_FALSE(sampler.nearest(unseen.cast<float>()).has_value());
}

TEST(VoxelSampler, TheNearestVoxelIsTheOneWithinHalfAVoxel)
{
  const TSDFVolume::Impl volume = linearVolume();
  VoxelSampler sampler(volume);
  const Eigen::Vector3i voxel(-1, 7, -8);
  const double expected = SLOPE.dot(voxel.cast<double>());
  for (const float x : {-0.49f, 0.49f})
    for (const float z : {-0.49f, 0.0f})
      EXPECT_NEAR(sampler.nearest(voxel.cast<float>() + Eigen::Vector3f(x, -x, z)).value(),
                  expected, DIGIT);
  EXPECT_FALSE(sampler.nearest({7.6f, 0, 0}).has_value());
  EXPECT_FALSE(sampler.nearest({0, -8.6f, 0}).has_value());
}

TEST(VoxelSampler, ColorIsThatOfTheNearestVoxelAndZeroWithoutBlock)
{
  TSDFVolume::Impl volume = linearVolume();
  const Eigen::Vector3i painted(0, -1, 7);
  blockOf(painted, volume.blocks).color[placeOf(painted)] = 0xabcdef01;
  VoxelSampler sampler(volume);
  EXPECT_EQ(sampler.color({0.4f, -1.4f, 6.6f}), 0xabcdef01);
  EXPECT_EQ(sampler.color({0.6f, -1, 7}), 0u);
  EXPECT_EQ(sampler.color({0, -1, 7.6f}), 0u);
}

TEST(VoxelSampler, TheLastBlockIsNotMistakenForAnother)
{
  const TSDFVolume::Impl volume = linearVolume();
  VoxelSampler sampler(volume);
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(sampler.block({0, 0, 0}), volume.blocks.find({0, 0, 0}));
    EXPECT_EQ(sampler.block({-1, 0, 0}), volume.blocks.find({-1, 0, 0}));
    EXPECT_EQ(sampler.block({8, 0, 0}), nullptr);
    EXPECT_EQ(sampler.block({7, 7, 7}), volume.blocks.find({0, 0, 0}));
  }
}
