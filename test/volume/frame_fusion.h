// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "rendered_frame.h"

#include "volume/voxel_fusion.h"

namespace bundle_icp::test {

/** An image that has one depth [m] and one colour all over. */
inline RGBDFrame
flatFrame(float depth, const cv::Vec3b& color = {50, 100, 150})
{
  const CameraIntrinsics camera = smallCamera();
  RGBDFrame frame;
  frame.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(depth));
  frame.color = cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar(color));
  return frame;
}

inline DepthSamples
samplesOf(const RGBDFrame& frame, const TSDFOptions& options = coarseOptions(), int num_threads = 1)
{
  const CameraIntrinsics camera = smallCamera();
  return {frame, camera, options, camera.depth_noise.sigma(1), num_threads};
}

/** A frame, ready to be fused block by block. */
class FrameFusion {
public:
  explicit FrameFusion(const RGBDFrame& frame, const TSDFOptions& options = coarseOptions(),
                       const ColorCorrection& correction = {},
                       const Pose& world_from_camera = Pose::Identity())
  : samples(samplesOf(frame, options)), image_from_world_(matrix() * world_from_camera.inverse()),
    view_(makeFusionView(samples, image_from_world_.linear(), options, correction))
  {
  }

  FrameFusion(const FrameFusion&) = delete;
  FrameFusion&
  operator=(const FrameFusion&) = delete;

  /** \param corner the block's first voxel [m] */
  bool
  fuse(const Eigen::Vector3d& corner, VoxelBlock& block, std::uint32_t seed = 1,
       float farthest = 100, const RegionClip* clip = nullptr) const
  {
    const Eigen::Vector3f at = (image_from_world_ * corner).cast<float>();
    return fuseBlock(view_, at.data(), farthest, clip, seed, block);
  }

  /** Weight of the measurement that a pixel makes. */
  float
  weight(const Eigen::Vector2d& pixel) const
  {
    const Eigen::Vector2i nearest = (pixel.array() + 0.5).floor().cast<int>();
    return samples.weight[std::size_t(nearest.y() * samples.camera.width + nearest.x())];
  }

  const FusionView&
  view() const
  {
    return view_;
  }

  const DepthSamples samples;

private:
  static Eigen::Affine3d
  matrix()
  {
    const CameraIntrinsics c = smallCamera();
    Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
    matrix.linear() << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1;
    return matrix;
  }

  Eigen::Affine3d image_from_world_;
  FusionView view_;
};

/** Visits the voxels of a block: visit(number, place [m]). */
template <typename Visit>
void
forEachVoxel(const Eigen::Vector3d& corner, double voxel_size, const Visit& visit)
{
  for (int i = 0; i < BLOCK_VOXELS; ++i)
    visit(i, Eigen::Vector3d(corner + voxel_size * Eigen::Vector3d(i % BLOCK_EDGE,
                                                                   i / BLOCK_EDGE % BLOCK_EDGE,
                                                                   i / BLOCK_SLAB)));
}

inline bool
areEqual(const VoxelBlock& one, const VoxelBlock& other)
{
  return std::memcmp(&one, &other, sizeof(VoxelBlock)) == 0;
}

} // namespace bundle_icp::test
