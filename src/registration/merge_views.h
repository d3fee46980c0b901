// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "warp_view.h"

#include <vector>

namespace bundle_icp {

/** A warped view with what turns its weights and normals to the virtual camera. */
struct Contribution {
  const DepthView* view = nullptr;
  WarpedView warped;
  Eigen::Matrix3f rotation; ///< virtual from view
  Eigen::Vector3f center;   ///< of the view, in the virtual frame
};

/** Equation (6): the weighted average, in each virtual pixel, of those that show the
 * nearest surface. Fills the images of `out`. */
void
mergeViews(const std::vector<Contribution>& contributions,
           const VirtualDepthOptions& options, VirtualDepth& out);

} // namespace bundle_icp
