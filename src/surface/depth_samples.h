// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/surface/tsdf_volume.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bundle_icp {

/** One frame as the fusion of voxels wants it: per pixel everything that does not
 * depend on the voxel, without NaN, row by row. */
struct DepthSamples {
  static constexpr int tile = 16; ///< edge of the tiles of min_depth and max_depth [px]

  CameraIntrinsics camera;
  std::vector<float> depth; ///< [m], 0 = not measured or out of range
  /** Weight (upper half, a float cut to 16 bits; 0 = do not use) and slope factor
   * (lower half, in 1/32768): the distance along the optical axis times the factor is
   * that along the surface normal. */
  std::vector<std::uint32_t> attributes;
  std::vector<std::uint32_t>
      color; ///< blue, green, red from the lowest byte up; may be empty
  int tiles_x = 0, tiles_y = 0;
  std::vector<Eigen::Vector2f>
      depth_range; ///< smallest and largest depth per tile; 0 = none

  DepthSamples(const RGBDFrame& frame, const CameraIntrinsics& camera,
               const TSDFOptions& options, int num_threads);
};

} // namespace bundle_icp
