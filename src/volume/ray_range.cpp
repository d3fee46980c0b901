// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/ray_range.h"

#include <algorithm>
#include <limits>

namespace bundle_icp {
namespace {

/** Nearer parts of blocks cover the whole image rather than be projected [m]. */
constexpr float NEAREST = 0.05f;

struct Box {
  Eigen::Vector2f low, high; ///< [px]
  RayRanges::Range range;
};

/** Part of the image that the block's corners span, with a voxel more to each side: a surface lies
 *  between voxels of two blocks, too. */
Box
project(const Eigen::Vector3i& block, float voxel_size, const CameraIntrinsics& camera,
        const Eigen::Isometry3f& camera_from_world)
{
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Box box{{infinity, infinity}, {-infinity, -infinity}, {infinity, -infinity}};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i side(corner & 1, corner >> 1 & 1, corner >> 2);
    const Eigen::Vector3i voxel =
        block * BLOCK_EDGE - Eigen::Vector3i::Ones() + side * (BLOCK_EDGE + 1);
    const Eigen::Vector3f p = camera_from_world * (voxel.cast<float>() * voxel_size);
    box.range.near = std::min(box.range.near, std::max(p.z(), NEAREST));
    box.range.far = std::max(box.range.far, p.z());
    if (p.z() < NEAREST) {
      box.low.setConstant(-infinity);
      box.high.setConstant(infinity);
      continue;
    }
    const Eigen::Vector2f pixel(float(camera.fx) * p.x() / p.z() + float(camera.cx),
                                float(camera.fy) * p.y() / p.z() + float(camera.cy));
    box.low = box.low.cwiseMin(pixel);
    box.high = box.high.cwiseMax(pixel);
  }
  return box;
}

} // namespace

RayRanges::RayRanges(const TSDFVolume::Impl& volume, const CameraIntrinsics& camera,
                     const Pose& camera_from_world)
: columns_(std::size_t((camera.width + TILE - 1) / TILE)),
  rows_(std::size_t((camera.height + TILE - 1) / TILE)),
  tiles_(columns_ * rows_, {std::numeric_limits<float>::infinity(), 0})
{
  const Eigen::Isometry3f transform = camera_from_world.cast<float>();
  const auto tile = [](float pixel, int size) {
    return std::size_t(std::clamp(pixel, 0.0f, float(size - 1))) / TILE;
  };
  for (std::size_t i = 0; i < volume.blocks.size(); ++i) {
    if (!volume.blocks.mayHoldSurface(i))
      continue;
    const Box box = project(volume.blocks.coordinatesOf(i), volume.voxelSize(), camera, transform);
    if (box.range.far < NEAREST || box.high.x() < 0 || box.high.y() < 0 ||
        box.low.x() > float(camera.width - 1) || box.low.y() > float(camera.height - 1))
      continue;
    for (std::size_t y = tile(box.low.y(), camera.height); y <= tile(box.high.y(), camera.height);
         ++y)
      for (std::size_t x = tile(box.low.x(), camera.width); x <= tile(box.high.x(), camera.width);
           ++x) {
        Range& range = tiles_[y * columns_ + x];
        range.near = std::min(range.near, box.range.near);
        range.far = std::max(range.far, box.range.far);
      }
  }
}

} // namespace bundle_icp
