// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/depth_edges.h"
#include "volume/depth_samples.h"
#include "volume/voxel_blocks.h"

#include <bundle_icp/volume/tsdf_volume.h>

#include <algorithm>

namespace bundle_icp {

/** Data of one frame for all voxels. Single precision is enough, because positions are relative to
 *  the camera. */
struct FusionView {
  const float* depth;
  const float* weight;
  const std::uint32_t* color; ///< null when the frame has none
  float color_weight;         ///< weight of all colours of the frame
  float gain[3];              ///< factors of blue, green and red
  int width, height;
  /** One voxel along x, y, z of the world, in the camera frame, times the camera matrix: its
   *  third coordinate is depth [m], the others are pixels times depth. */
  float step[3][3];
  float voxel_size, truncation, inverse_truncation, min_depth;
  DepthSigma sigma;
  DepthEdges edges;
};

/** Voxels behind the surface over which the weight of a measurement falls to zero: enough for a
 *  surface slanted by 75 degrees, whose cells reach far behind it along the optical axis. */
constexpr float fall_off_voxels = 4;

/** Distance [m] behind a surface at depth z up to which voxels take part: in full for one voxel and
 *  the noise. */
inline double
reachBehind(const TSDFOptions& options, const DepthNoise& noise, double z)
{
  return std::min(options.truncation, (1 + fall_off_voxels) * options.voxel_size + noise.sigma(z));
}

/** The part of a block that lies in the volume's region, in the frame of that box. */
struct RegionClip {
  float corner[3];  ///< the block's first voxel [m]
  float step[3][3]; ///< one voxel along x, y, z of the world [m]
  float half[3];    ///< of the box's edges [m]
};

/** `image_from_world` turns the world's axes to those of FusionView::step. */
FusionView
makeFusionView(const DepthSamples& samples, const Eigen::Matrix3d& image_from_world,
               const TSDFOptions& options, const ColorCorrection& correction);

/** Equation (7) in one voxel X_w: the mean over all frames. */
struct VoxelMean {
  float S = 0; ///< S_k(X_w), proj(T_w^i X_w) - D_i with the sign that is positive in front [mu]
  float W = 0; ///< W_k(X_w), the sum of weights
};

/** Equation (7) in one voxel at `at`, in the coordinates of FusionView::step, whose third is
 *  proj(T_w^i X_w): what fuseBlock() does, without rounding to 16 bits. */
void
fuseVoxel(const FusionView& view, const float at[3], VoxelMean& voxel);

/** Equation (7) for a block of voxels. The first lies at `corner`, in the coordinates of
 *  FusionView::step; those beyond the depth `farthest` do not change. `seed` drives the unbiased
 *  rounding to the block's 16 bits; `clip` is null where all of the block lies in the region.
 *  Returns true when a voxel that it changed lies behind the surface. */
bool
fuseBlock(const FusionView& view, const float corner[3], float farthest, const RegionClip* clip,
          std::uint32_t seed, VoxelBlock& block);

} // namespace bundle_icp
