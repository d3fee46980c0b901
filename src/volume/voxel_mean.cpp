// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/voxel_mean.h"

#include <algorithm>

namespace bundle_icp {

void
fuseVoxel(const FusionView& view, const float at[3], VoxelMean& voxel)
{
  const float mu = view.truncation, z = at[2], u = at[0] / z, v = at[1] / z;
  if (!(z > view.min_depth && u >= 0 && v >= 0 && u < float(view.width - 1) &&
        v < float(view.height - 1)))
    return;
  const int nearest = int(v + 0.5f) * view.width + int(u + 0.5f);
  float D = view.depth[nearest];
  if (!(D > 0 && D - z > -mu))
    return;
  if (D - z < mu) {
    const int u0 = int(u), v0 = int(v);
    const float* const upper = view.depth + v0 * view.width + u0;
    const float* const lower = upper + view.width;
    const auto [low, high] = std::minmax({upper[0], upper[1], lower[0], lower[1]});
    const float fu = u - float(u0), fv = v - float(v0);
    if (low > 0 && high - low < view.edges.tolerance(high))
      D = (1 - fv) * ((1 - fu) * upper[0] + fu * upper[1]) +
          fv * ((1 - fu) * lower[0] + fu * lower[1]);
  }
  const float S = std::max(-1.0f, std::min(1.0f, (D - z) / mu));
  const float behind = z - D - view.voxel_size - view.sigma(z);
  const float W =
      view.weight[nearest] * std::min(1.0f, 1 - behind / (FALL_OFF_VOXELS * view.voxel_size));
  if (!(W > 0))
    return;
  voxel.S = (voxel.W * voxel.S + W * S) / (voxel.W + W);
  voxel.W += W;
}

} // namespace bundle_icp
