// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/voxel_blocks.h"

#include <bundle_icp/volume/tsdf_volume.h>

namespace bundle_icp {

struct TSDFVolume::Impl {
  TSDFOptions options;
  VoxelBlockMap blocks;
  std::uint32_t num_frames = 0; ///< fused so far
  double unit_sigma = 0;        ///< sigma at weight 1: that of the first frame's camera at 1 m [m]

  float
  voxelSize() const
  {
    return float(options.voxel_size);
  }
};

} // namespace bundle_icp
