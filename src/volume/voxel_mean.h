// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/fusion_view.h"

namespace bundle_icp {

/** Equation (7) in one voxel X_w: the mean of what all frames have said. */
struct VoxelMean {
  float S = 0; ///< S_k(X_w), proj(T_w^i X_w) - D_i with the sign that is positive in front [mu]
  float W = 0; ///< W_k(X_w), the sum of weights
};

/** Equation (7) in one voxel at `at`, in the coordinates of FusionView::step, whose third is
 *  proj(T_w^i X_w): what fuseBlock() does, without rounding to 16 bits. */
void
fuseVoxel(const FusionView& view, const float at[3], VoxelMean& voxel);

} // namespace bundle_icp
