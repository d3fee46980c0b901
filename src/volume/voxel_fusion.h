// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/fusion_view.h"
#include "volume/voxel_blocks.h"

namespace bundle_icp {

/** The part of a block that lies in the volume's region, in the frame of that box. */
struct RegionClip {
  float corner[3];  ///< the block's first voxel [m]
  float step[3][3]; ///< one voxel along x, y, z of the world [m]
  float half[3];    ///< of the box's edges [m]
};

/** Equation (7) for a block of voxels. The first lies at `corner`, in the coordinates of
 *  FusionView::step; those beyond the depth `farthest` do not change. `seed` drives the unbiased
 *  rounding to the block's 16 bits; `clip` is null where all of the block lies in the region.
 *  Returns true when a voxel that it changed lies behind the surface. */
bool
fuseBlock(const FusionView& view, const float corner[3], float farthest, const RegionClip* clip,
          std::uint32_t seed, VoxelBlock& block);

} // namespace bundle_icp
