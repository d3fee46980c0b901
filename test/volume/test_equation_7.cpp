// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Equation (7) as it is written, one voxel after another, beside what fuses blocks of
// them.
#include "rendered_frame.h"
#include "variants.h"

#include "volume/voxel_fusion.h"
#include "volume/voxel_mean.h"

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr int HALF = 4; ///< of the blocks along each axis
constexpr int NUM_FRAMES = 3;

struct View {
  DepthSamples samples;
  Eigen::Affine3d image_from_world;
  FusionView fusion;

  explicit View(int frame)
  : samples(noisyFrame(frame), smallCamera(), coarseOptions(), smallCamera().depth_noise.sigma(1),
            1),
    image_from_world(Eigen::Affine3d(camera()) * pose(frame).inverse()),
    fusion(makeFusionView(samples, image_from_world.linear(), coarseOptions(), {}))
  {
  }

  /** A sphere in the middle of the blocks, as seen from a metre away. */
  static Pose
  pose(int frame)
  {
    Pose pose = Pose::Identity();
    pose.rotate(Eigen::AngleAxisd(0.3 * frame, Eigen::Vector3d(0.2, 1, 0).normalized()));
    pose.translate(Eigen::Vector3d(0, 0, -1));
    return pose;
  }

  static RGBDFrame
  noisyFrame(int frame)
  {
    RGBDFrame rendered = render(sphere(0.2), pose(frame));
    std::mt19937 random(frame);
    std::normal_distribution<float> noise(0, 0.001f);
    for (auto z = rendered.depth.begin<float>(); z != rendered.depth.end<float>(); ++z)
      *z += noise(random);
    return rendered;
  }

  static Eigen::Matrix3d
  camera()
  {
    const CameraIntrinsics c = smallCamera();
    return (Eigen::Matrix3d() << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1).finished();
  }
};

} // namespace

TEST(Equation7, BlocksHoldTheMeanOfEachVoxel)
{
  const View views[NUM_FRAMES] = {View(0), View(1), View(2)};
  std::size_t fused = 0, inside = 0, equal = 0;
  const double edge = BLOCK_EDGE * coarseOptions().voxel_size;
  const auto check = [&](const Eigen::Vector3d& corner) {
    VoxelBlock block{};
    std::vector<VoxelMean> expected(BLOCK_VOXELS);
    for (const View& view : views) {
      const Eigen::Vector3f at = (view.image_from_world * corner).cast<float>();
      fuseBlock(view.fusion, at.data(), 10, nullptr, 1, block);
      for (int i = 0; i < BLOCK_VOXELS; ++i) {
        Eigen::Vector3f voxel = at;
        const int steps[3] = {i % BLOCK_EDGE, i / BLOCK_EDGE % BLOCK_EDGE, i / BLOCK_SLAB};
        for (int axis = 0; axis < 3; ++axis)
          voxel += float(steps[axis]) * Eigen::Map<const Eigen::Vector3f>(view.fusion.step[axis]);
        fuseVoxel(view.fusion, voxel.data(), expected[i]);
      }
    }
    for (int i = 0; i < BLOCK_VOXELS; ++i) {
      const float S = float(block.distance[i]) / DISTANCE_SCALE, W = decodeWeight(block.weight[i]);
      fused += expected[i].W > 0;
      inside += expected[i].S < 0;
      // A digit of 16 bits of distance, and of 11 of weight, a frame.
      equal += std::abs(S - expected[i].S) < NUM_FRAMES * 2e-4f &&
               std::abs(W - expected[i].W) <= NUM_FRAMES * 1e-3f * expected[i].W;
    }
  };
  forEachVariant([&] {
    fused = inside = equal = 0;
    for (int i = 0; i < 8 * HALF * HALF * HALF; ++i)
      check(edge * Eigen::Vector3d(i % (2 * HALF) - HALF, i / (2 * HALF) % (2 * HALF) - HALF,
                                   i / (4 * HALF * HALF) - HALF));
    EXPECT_GT(fused, 20000u);
    EXPECT_GT(inside, 2000u);
    // Where rounding decides which pixel is the nearest, or whether four are of one
    // surface.
    EXPECT_GT(double(equal), 0.9995 * 8 * HALF * HALF * HALF * BLOCK_VOXELS);
  });
}
