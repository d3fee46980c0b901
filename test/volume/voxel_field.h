// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/voxel_blocks.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace bundle_icp::test {

/** Distance at a voxel, in truncations. */
using Field = std::function<double(const Eigen::Vector3i& voxel)>;

/** Code of the weight 1. */
inline constexpr std::uint16_t UNIT_WEIGHT = 14 << 11;

/** Adds the blocks from `first` to `last`, all voxels observed with weight 1. */
inline void
fillBlocks(const Eigen::Vector3i& first, const Eigen::Vector3i& last, const Field& field,
           VoxelBlockMap& blocks)
{
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x) {
        const Eigen::Vector3i coordinates(x, y, z);
        blocks.insert(VoxelBlockMap::key(coordinates));
        const std::size_t number = blocks.indexOf(coordinates);
        VoxelBlock& block = blocks[number];
        for (int i = 0; i < BLOCK_VOXELS; ++i) {
          const Eigen::Vector3i within(i % BLOCK_EDGE, i / BLOCK_EDGE % BLOCK_EDGE, i / BLOCK_SLAB);
          const double distance = field(BLOCK_EDGE * coordinates + within);
          block.distance[i] =
              std::int16_t(std::lround(std::clamp(distance, -1.0, 1.0) * DISTANCE_SCALE));
          block.weight[i] = UNIT_WEIGHT;
          if (distance < 0)
            blocks.setMayHoldSurface(number);
        }
      }
}

/** Place of a voxel within its block. */
inline int
placeOf(const Eigen::Vector3i& voxel)
{
  return (voxel.z() & 7) * BLOCK_SLAB + (voxel.y() & 7) * BLOCK_EDGE + (voxel.x() & 7);
}

/** The block of a voxel, which must exist. */
inline VoxelBlock&
blockOf(const Eigen::Vector3i& voxel, VoxelBlockMap& blocks)
{
  return blocks[std::size_t(blocks.indexOf({voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3}))];
}

} // namespace bundle_icp::test
