// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/volume/tsdf_volume.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bundle_icp {

/** The highest byte of DepthSamples::color says how much the colour is worth: little next
 *  to depth edges, where it may be that of another surface. */
constexpr int QUALITY_SHIFT = 24;
constexpr std::uint32_t BEST_QUALITY = 255;

/** One frame in the form for the fusion of voxels: all data per pixel that does not depend on the
 *  voxel, without NaN, row by row. */
struct DepthSamples {
  static constexpr int tile = 8; ///< edge of the tiles of depth_range [px]

  CameraIntrinsics camera;
  std::vector<float> depth;  ///< [m], 0 = not measured or out of range
  std::vector<float> weight; ///< weight of the measurement, 0 = do not use
  /** Blue, green, red, quality from the lowest byte up; empty without colour. */
  std::vector<std::uint32_t> color;
  int tiles_x = 0, tiles_y = 0;
  /** Smallest and largest depth per tile, row by row; (infinity, 0) = none. */
  std::vector<Eigen::Vector2f> depth_range;

  /** \param unit_sigma standard deviation of a depth of weight 1 [m] */
  DepthSamples(const RGBDFrame& frame, const CameraIntrinsics& camera, const TSDFOptions& options,
               double unit_sigma, int num_threads);
};

} // namespace bundle_icp
