// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "frame_fusion.h"
#include "variants.h"

#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double VOXEL = 0.01;
/** First voxel of a block around the optical axis, which runs through the plane at 1 m between
 *  voxels. */
const Eigen::Vector3d AT_WALL(-0.033, -0.037, 0.967);

TSDFOptions
optionsOf(double truncation)
{
  TSDFOptions options = coarseOptions();
  options.truncation = truncation;
  return options;
}

float
distanceOf(const VoxelBlock& block, int voxel)
{
  return float(block.distance[voxel]) / DISTANCE_SCALE;
}

/** How much a measurement at depth z counts in a voxel so far behind it. */
double
shareBehind(double behind, double z)
{
  const double over = behind - VOXEL - smallCamera().depth_noise.sigma(z);
  return std::clamp(1 - over / (4 * VOXEL), 0.0, 1.0);
}

/** A digit of the distance and one of the weight. */
void
expectVoxel(const VoxelBlock& block, int voxel, double distance, double weight)
{
  EXPECT_NEAR(distanceOf(block, voxel), distance, 1.2 / DISTANCE_SCALE) << "voxel " << voxel;
  EXPECT_NEAR(decodeWeight(block.weight[voxel]), weight, 6e-4 * weight) << "voxel " << voxel;
}

} // namespace

TEST(VoxelFusion, AFrontalWallIsTruncatedAndFadesBehind)
{
  for (const double truncation : {0.04, 0.1}) {
    const FrameFusion frame(flatFrame(1), optionsOf(truncation));
    for (const double first : {0.867, 0.947, 1.027})
      forEachVariant([&] {
        VoxelBlock block{};
        const Eigen::Vector3d corner(AT_WALL.x(), AT_WALL.y(), first);
        frame.fuse(corner, block);
        forEachVoxel(corner, VOXEL, [&](int i, const Eigen::Vector3d& p) {
          const double behind = p.z() - 1, share = shareBehind(behind, p.z());
          if (behind > truncation || share == 0)
            return expectVoxel(block, i, 0, 0);
          expectVoxel(block, i, std::min(1.0, -behind / truncation),
                      share * frame.weight(smallCamera().project(p)));
        });
      });
  }
}

TEST(VoxelFusion, FramesAreAveragedByTheirWeights)
{
  // The second is farther and noisier, so that it counts less.
  const FrameFusion first(flatFrame(0.99f), optionsOf(0.1)),
      second(flatFrame(1.02f), optionsOf(0.1));
  VoxelBlock forward{}, backward{};
  first.fuse(AT_WALL, forward);
  second.fuse(AT_WALL, forward);
  second.fuse(AT_WALL, backward);
  first.fuse(AT_WALL, backward);
  forEachVoxel(AT_WALL, VOXEL, [&](int i, const Eigen::Vector3d& p) {
    double sum = 0, weights = 0;
    for (const auto& [frame, depth] :
         {std::make_pair(&first, 0.99), std::make_pair(&second, 1.02)}) {
      const double weight =
          shareBehind(p.z() - depth, p.z()) * frame->weight(smallCamera().project(p));
      sum += weight * (depth - p.z()) / 0.1;
      weights += weight;
    }
    ASSERT_GT(weights, 0);
    for (const VoxelBlock& block : {forward, backward}) {
      EXPECT_NEAR(distanceOf(block, i), sum / weights, 3e-4); // a digit of the weight counts, too
      EXPECT_NEAR(decodeWeight(block.weight[i]), weights, 1.2e-3 * weights);
    }
  });
}

TEST(VoxelFusion, FreeSpaceCarvesWhatOneFrameSaw)
{
  const FrameFusion wrong(flatFrame(1)), right(flatFrame(2));
  VoxelBlock block{};
  EXPECT_TRUE(wrong.fuse(AT_WALL, block));
  const VoxelBlock once = block;
  constexpr int times = 20;
  for (int i = 0; i < times; ++i)
    right.fuse(AT_WALL, block, 7 * i);
  forEachVoxel(AT_WALL, VOXEL, [&](int i, const Eigen::Vector3d& p) {
    const double weight = times * right.weight(smallCamera().project(p)),
                 old_weight = decodeWeight(once.weight[i]);
    const double expected = (old_weight * distanceOf(once, i) + weight) / (old_weight + weight);
    EXPECT_NEAR(distanceOf(block, i), expected, 0.005);
  });
  // What lay behind the wrong surface is free now.
  EXPECT_GT(*std::min_element(block.distance, block.distance + BLOCK_VOXELS), 0);
}

TEST(VoxelFusion, TellsWhetherItPutAVoxelBehindTheSurface)
{
  VoxelBlock block{};
  for (const float depth : {0.5f, 1.2f, 0.0f}) // before the block, after it, not measured
    EXPECT_FALSE(FrameFusion(flatFrame(depth)).fuse(AT_WALL, block)) << depth;
  // What was free before stays in front on average.
  EXPECT_FALSE(FrameFusion(flatFrame(1)).fuse(AT_WALL, block));
  block = {};
  EXPECT_TRUE(FrameFusion(flatFrame(1)).fuse(AT_WALL, block));
  // Only what this frame changes counts.
  EXPECT_FALSE(FrameFusion(flatFrame(0)).fuse(AT_WALL, block));
}

TEST(VoxelFusion, NothingChangesWhereThePixelsSayNothing)
{
  const FrameFusion wall(flatFrame(1)), far(flatFrame(3)), hidden(flatFrame(0.9f));
  const auto expectUntouched = [](const FrameFusion& frame, const Eigen::Vector3d& corner) {
    VoxelBlock block{};
    EXPECT_FALSE(frame.fuse(corner, block));
    EXPECT_TRUE(areEqual(block, VoxelBlock{})) << corner.transpose();
  };
  forEachVariant([&] {
    expectUntouched(hidden, AT_WALL);
    expectUntouched(FrameFusion(flatFrame(NAN)), AT_WALL);
    expectUntouched(wall, {-0.04, -0.04, -1.04}); // behind the camera
    expectUntouched(wall, {0.7, 0, 0.97});        // right of the image
    expectUntouched(wall, {0, -0.6, 0.97});       // above it
    expectUntouched(far, {-0.04, -0.04, 0.02});   // nearer than min_depth
  });
}

TEST(VoxelFusion, AtTheRimOnlyVoxelsInTheImageChange)
{
  const FrameFusion frame(flatFrame(1));
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(0.568, -0.04, 0.961), Eigen::Vector3d(-0.642, 0.42, 0.961),
        Eigen::Vector3d(0.01, -0.49, 0.961)})
    forEachVariant([&] {
      VoxelBlock block{};
      frame.fuse(corner, block);
      int shown = 0;
      forEachVoxel(corner, VOXEL, [&](int i, const Eigen::Vector3d& p) {
        const Eigen::Vector2d pixel = smallCamera().project(p);
        const bool in_image = pixel.minCoeff() >= 0 && pixel.x() < 319 && pixel.y() < 239;
        EXPECT_EQ(block.weight[i] > 0, in_image) << p.transpose();
        shown += in_image;
      });
      EXPECT_GT(shown, 50);
      EXPECT_LT(shown, BLOCK_VOXELS - 50);
    });
}

TEST(VoxelFusion, RowsBeyondTheFarthestDepthStay)
{
  const FrameFusion frame(flatFrame(1));
  VoxelBlock all{}, part{};
  frame.fuse(AT_WALL, all);
  frame.fuse(AT_WALL, part, 1, 0.999f);
  forEachVoxel(AT_WALL, VOXEL, [&](int i, const Eigen::Vector3d& p) {
    EXPECT_EQ(part.distance[i], p.z() < 0.999 ? all.distance[i] : 0);
    EXPECT_EQ(part.weight[i], p.z() < 0.999 ? all.weight[i] : 0);
  });
}

TEST(VoxelFusion, AClipKeepsToTheRegionAndChangesNothingInIt)
{
  const FrameFusion frame(flatFrame(1));
  const OrientedBox box(Pose(Eigen::Translation3d(0.01, 0, 1) *
                             Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized())),
                        {0.05, 0.06, 0.04});
  const Pose box_from_world = box.world_from_box.inverse();
  RegionClip clip;
  Eigen::Map<Eigen::Vector3f>(clip.corner) = (box_from_world * AT_WALL).cast<float>();
  Eigen::Map<Eigen::Vector3f>(clip.half) = (0.5 * box.size).cast<float>();
  for (int axis = 0; axis < 3; ++axis)
    Eigen::Map<Eigen::Vector3f>(clip.step[axis]) =
        (VOXEL * box_from_world.linear().col(axis)).cast<float>();
  forEachVariant([&] {
    VoxelBlock all{}, part{};
    frame.fuse(AT_WALL, all);
    frame.fuse(AT_WALL, part, 1, 100, &clip);
    int inside = 0;
    forEachVoxel(AT_WALL, VOXEL, [&](int i, const Eigen::Vector3d& p) {
      const bool is_inside = box.contains(p);
      EXPECT_EQ(part.distance[i], is_inside ? all.distance[i] : 0);
      EXPECT_EQ(part.weight[i], is_inside ? all.weight[i] : 0);
      EXPECT_EQ(part.color[i], is_inside ? all.color[i] : 0u);
      inside += is_inside;
    });
    EXPECT_NEAR(inside, box.size.prod() / std::pow(VOXEL, 3), 25);
  });
}

TEST(VoxelFusion, RoundingIsRightOnAverage)
{
  const FrameFusion frame(flatFrame(1), optionsOf(0.1));
  constexpr int times = 500;
  std::vector<double> distances(BLOCK_EDGE), weights(BLOCK_EDGE), exact_weights(BLOCK_EDGE);
  std::set<int> digits;
  for (int seed = 0; seed < times; ++seed) {
    VoxelBlock block{};
    frame.fuse(AT_WALL, block, std::uint32_t(seed) * 2654435761u);
    forEachVoxel(AT_WALL, VOXEL, [&](int i, const Eigen::Vector3d& p) {
      distances[i / BLOCK_SLAB] += block.distance[i] / double(times * BLOCK_SLAB);
      weights[i / BLOCK_SLAB] += decodeWeight(block.weight[i]);
      exact_weights[i / BLOCK_SLAB] +=
          shareBehind(p.z() - 1, p.z()) * frame.weight(smallCamera().project(p));
    });
    digits.insert(block.distance[0]);
  }
  EXPECT_EQ(digits.size(), 2u); // the one above and the one below
  for (int z = 0; z < BLOCK_EDGE; ++z) {
    const double exact = (1 - AT_WALL.z() - z * VOXEL) / 0.1 * DISTANCE_SCALE;
    // Single precision of a depth of 1 m is a twentieth of a digit.
    EXPECT_NEAR(distances[z], exact, 0.1);
    EXPECT_NEAR(weights[z] / exact_weights[z], 1, 2e-5);
  }
}

TEST(VoxelFusion, ColorIsKeptNearTheSurfaceTimesTheGain)
{
  ColorCorrection correction;
  correction.gain = {2, 0.5f, 3};
  const FrameFusion plain(flatFrame(1)), corrected(flatFrame(1), coarseOptions(), correction);
  VoxelBlock usual{}, other{};
  plain.fuse(AT_WALL, usual);
  corrected.fuse(AT_WALL, other);
  forEachVoxel(AT_WALL, VOXEL, [&](int i, const Eigen::Vector3d& p) {
    if (std::abs(p.z() - 1) > 0.02) {
      EXPECT_EQ(usual.color[i], 0u);
      return;
    }
    EXPECT_LT(
        (decodeColor(usual.color[i]) - Eigen::Vector3f(150, 100, 50)).lpNorm<Eigen::Infinity>(),
        1.01f);
    // Red is cut off at white.
    EXPECT_LT(
        (decodeColor(other.color[i]) - Eigen::Vector3f(255, 50, 100)).lpNorm<Eigen::Infinity>(),
        1.01f);
  });
  RGBDFrame colorless = flatFrame(1);
  colorless.color.release();
  const VoxelBlock before = usual;
  FrameFusion(colorless).fuse(AT_WALL, usual);
  EXPECT_TRUE(std::equal(before.color, before.color + BLOCK_VOXELS, usual.color));
  EXPECT_FALSE(std::equal(before.weight, before.weight + BLOCK_VOXELS, usual.weight));
}

TEST(FusionView, ReachesBehindByTheGridAndTheNoiseUpToTheTruncation)
{
  const DepthNoise noise = smallCamera().depth_noise;
  for (const double z : {0.5, 1.0, 3.0}) {
    EXPECT_DOUBLE_EQ(reachBehind(optionsOf(0.04), noise, z), 0.04);
    EXPECT_DOUBLE_EQ(reachBehind(optionsOf(0.9), noise, z), 5 * VOXEL + noise.sigma(z));
  }
}

TEST(FusionView, StepsAreVoxelsTimesTheCameraMatrix)
{
  const Pose pose = lookAt({0.3, -0.2, -1}, {0.1, 0, 0});
  const FrameFusion frame(flatFrame(1), coarseOptions(), {}, pose);
  const CameraIntrinsics camera = smallCamera();
  const Eigen::Vector3d from(0.05, 0.1, -0.1);
  const auto inImage = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    const Eigen::Vector3d q = pose.inverse() * p;
    return q.z() * Eigen::Vector3d(camera.project(q).homogeneous());
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step =
        inImage(from + VOXEL * Eigen::Vector3d::Unit(axis)) - inImage(from);
    EXPECT_TRUE(Eigen::Map<const Eigen::Vector3f>(frame.view().step[axis])
                    .isApprox(step.cast<float>(), 1e-5f));
  }
  EXPECT_EQ(frame.view().width, camera.width);
  EXPECT_FLOAT_EQ(frame.view().truncation * frame.view().inverse_truncation, 1);
}
