// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "surface/depth_samples.h"
#include "surface/voxel_blocks.h"

namespace bundle_icp {

/** Keys of the blocks that the truncation bands of a frame run through, in an order
 *  that does not depend on the number of threads; some appear more than once. */
std::vector<std::uint64_t>
findBandBlocks(const DepthSamples& samples, const Pose& world_from_camera,
               const TSDFOptions& options, int num_threads);

/** Numbers of the blocks that the frame can change: in view, and not hidden behind the
 *  surface. */
std::vector<std::uint32_t>
findVisibleBlocks(const VoxelBlockMap& blocks, const DepthSamples& samples,
                  const Pose& camera_from_world, const TSDFOptions& options,
                  int num_threads);

} // namespace bundle_icp
