// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/tsdf_volume_impl.h"

#include <optional>

namespace bundle_icp {

/** Reads a volume at nearby positions and remembers the last block. Positions are in voxels. Each
 *  thread needs its own sampler. */
class VoxelSampler {
public:
  explicit VoxelSampler(const TSDFVolume::Impl& volume) : blocks_(volume.blocks) {}

  /** The block that holds a voxel, or null. */
  const VoxelBlock*
  block(const Eigen::Vector3i& voxel);

  /** Distance of the nearest voxel in units of the truncation, unset when not observed.
   */
  std::optional<float>
  nearest(const Eigen::Vector3f& position);

  /** Trilinear distance in units of the truncation; unset unless all eight voxels are
   *  observed. */
  std::optional<float>
  distance(const Eigen::Vector3f& position);

  /** The distance at `within` [0, 1) of the way from voxel `cell` to the next along each axis. */
  std::optional<float>
  distance(const Eigen::Vector3i& cell, const Eigen::Vector3f& within);

  /** Central differences of distance() over a voxel to each side. */
  std::optional<Eigen::Vector3f>
  gradient(const Eigen::Vector3f& position);

  /** Coded colour of the nearest voxel, 0 = none. */
  std::uint32_t
  color(const Eigen::Vector3f& position);

private:
  const VoxelBlockMap& blocks_;
  const VoxelBlock* last_ = nullptr;
  Eigen::Vector3i last_coordinates_ =
      Eigen::Vector3i::Constant(VoxelBlockMap::limit); ///< no block's
};

} // namespace bundle_icp
