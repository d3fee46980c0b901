// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/depth_edges.h"
#include "common/depth_sigma.h"
#include "volume/depth_samples.h"

#include <bundle_icp/volume/tsdf_volume.h>

#include <algorithm>

namespace bundle_icp {

/** What all voxels of one frame share. Single precision, because positions are relative
 *  to the camera. */
struct FusionView {
  const float* depth;
  const float* weight;
  const std::uint32_t* color; ///< null when the frame has none
  float color_weight;         ///< of all of its colours
  float gain[3];              ///< blue, green, red: what the colours are multiplied by
  int width, height;
  /** One voxel along x, y, z of the world, in the camera frame, times the camera matrix: its
   *  third coordinate is depth [m], the others are pixels times depth. */
  float step[3][3];
  float voxel_size, truncation, inverse_truncation, min_depth;
  DepthSigma sigma;
  DepthEdges edges;
};

/** Behind the surface the weight of a measurement falls to zero over so many voxels: enough for a
 *  surface slanted by 75 degrees, whose cells reach far behind it along the optical axis. */
constexpr float FALL_OFF_VOXELS = 4;

/** How far behind a surface at depth z voxels take part [m]: in full for one voxel and the noise.
 *  */
inline double
reachBehind(const TSDFOptions& options, const DepthNoise& noise, double z)
{
  return std::min(options.truncation, (1 + FALL_OFF_VOXELS) * options.voxel_size + noise.sigma(z));
}

/** `image_from_world` turns the world's axes to those of FusionView::step. */
FusionView
makeFusionView(const DepthSamples& samples, const Eigen::Matrix3d& image_from_world,
               const TSDFOptions& options, const ColorCorrection& correction);

} // namespace bundle_icp
