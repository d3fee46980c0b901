// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "surface/depth_samples.h"
#include "surface/voxel_blocks.h"

namespace bundle_icp {

/** What all voxels of one frame share. Single precision, because positions are relative
 *  to the camera. */
struct FusionView {
  const float* depth;
  const float* weight;
  const std::uint32_t* color; ///< null when the frame has none
  int width, height;
  float fx, fy, cx, cy;
  float step[3][3]; ///< camera frame: one voxel along x, y, z of the world [m]
  float truncation, min_depth;
  float constant, quadratic, offset; ///< DepthNoise
};

/** Fuses the frame into one block, whose first voxel lies at `corner` in the camera
 *  frame. `seed` drives the unbiased rounding to the block's 16 bits. Returns true when
 *  a voxel that it changed lies behind the surface. */
bool
fuseBlock(const FusionView& view, const float corner[3], std::uint32_t seed,
          VoxelBlock& block);

} // namespace bundle_icp
