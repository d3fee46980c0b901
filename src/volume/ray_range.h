// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/tsdf_volume_impl.h"

#include <vector>

namespace bundle_icp {

/** Range of depth in which rays of a view can meet the volume: that of the blocks in each tile of
 *  the image, as in Kaehler et al. (InfiniTAM, TVCG 2015), section 4.3. Rays skip empty space, most
 *  of their length. */
class RayRanges {
public:
  struct Range {
    float near, far; ///< depth along the optical axis [m]; near > far: nothing
  };

  RayRanges(const TSDFVolume::Impl& volume, const CameraIntrinsics& camera,
            const Pose& camera_from_world);

  const Range&
  at(int x, int y) const
  {
    return tiles_[std::size_t(y / TILE) * columns_ + std::size_t(x / TILE)];
  }

private:
  static constexpr int TILE = 8; ///< pixels

  std::size_t columns_, rows_;
  std::vector<Range> tiles_;
};

} // namespace bundle_icp
