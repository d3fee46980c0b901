// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/depth_samples.h"
#include "volume/voxel_blocks.h"

namespace bundle_icp {

/** Keys of the blocks that the truncation bands of a frame run through, in an order
 *  that does not depend on the number of threads; some appear more than once. */
std::vector<std::uint64_t>
findBandBlocks(const DepthSamples& samples, const Pose& world_from_camera,
               const TSDFOptions& options, int num_threads);

/** A block that a frame can change: in view and not hidden behind the surface. */
struct VisibleBlock {
  std::uint32_t number;
  float farthest; ///< no voxel of the block beyond this depth changes [m]
};

std::vector<VisibleBlock>
findVisibleBlocks(const VoxelBlockMap& blocks, const DepthSamples& samples,
                  const Pose& camera_from_world, const TSDFOptions& options, int num_threads);

} // namespace bundle_icp
