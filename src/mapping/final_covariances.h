// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include <utility>
#include <vector>

namespace bundle_icp {

/** A frame of a component, and what is known of its pose by itself; along the axes of the model's
 *  world. */
struct FinalPose {
  std::size_t frame = 0;
  bool is_adjusted = false;           ///< its pose was adjusted with those of others
  Matrix6d own = Matrix6d::Zero();    ///< covariance given the model
  Matrix6d change = Matrix6d::Zero(); ///< what the motion prior added to `own`
};

/** Covariances by frame, of rotation [rad] and position [m] relative to the component's earliest
 *  frame, along the axes of that frame's camera. */
using FinalCovariances = std::vector<std::pair<std::size_t, Matrix6d>>;

/** How well the poses of a component are known: those adjusted together from all of their evidence
 *  at once, the others as well as the nearest of these and as they were registered to the model.
 *  \param evidence of the adjustment that gave the poses of `model`
 *  \param poses in the order of time */
FinalCovariances
finalCovariances(const ImageGraph& graph, const SparseModel& model,
                 BundleAdjustmentProblem evidence, const BundleAdjustmentOptions& options,
                 const std::vector<FinalPose>& poses);

} // namespace bundle_icp
