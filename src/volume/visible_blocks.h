// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/depth_samples.h"
#include "volume/voxel_blocks.h"

namespace bundle_icp {

/** A block that a frame can change: in view, and not hidden behind the surface. */
struct VisibleBlock {
  std::uint32_t number;
  float farthest; ///< depth beyond which no voxel of it changes [m]
};

/** The blocks that a frame can change, in the order of their numbers. */
std::vector<VisibleBlock>
findVisibleBlocks(const VoxelBlockMap& blocks, const DepthSamples& samples,
                  const Pose& camera_from_world, const TSDFOptions& options, int num_threads);

} // namespace bundle_icp
