// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/depth_sigma.h"
#include "virtual_depth/warp_view.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace bundle_icp {

/** The pixel buffer that one view is rendered into. */
class WarpTarget {
public:
  WarpTarget(const CameraIntrinsics& camera, const VirtualDepthOptions& options)
  : width(camera.width), height(camera.height), pixels(std::size_t(width) * std::size_t(height)),
    averaged_(pixels.size()), reach_(camera.depth_noise, options.merge_sigmas)
  {
  }

  /** Noise folds a mesh that is seen from aside, so that a pixel meets its surface
   * several times. These are averaged: taking the nearest would pull the surface to the
   * camera. */
  void
  add(int index, float inverse_z, int source)
  {
    const std::size_t at = std::size_t(index);
    WarpedPixel& pixel = pixels[at];
    if (pixel.inverse_depth == 0) {
      pixel = {inverse_z, source};
      return;
    }
    const float held = pixel.inverse_depth;
    const float nearest = std::max(held, inverse_z);
    // sigma(z) / z^2 is the standard deviation of inverse depth.
    const float tolerance = reach_(1 / nearest) * nearest * nearest;
    if (std::abs(inverse_z - held) <= tolerance) {
      std::uint8_t& averaged = averaged_[at];
      averaged += averaged < MAX_AVERAGED;
      pixel.inverse_depth += (inverse_z - held) / float(averaged + 1);
    }
    else if (inverse_z > held) {
      pixel = {inverse_z, source};
      averaged_[at] = 0;
    }
  }

  const int width, height;
  WarpedView pixels;

private:
  static constexpr std::uint8_t MAX_AVERAGED = 254;

  std::vector<std::uint8_t> averaged_; // with the value first held
  DepthSigma reach_;
};

} // namespace bundle_icp
