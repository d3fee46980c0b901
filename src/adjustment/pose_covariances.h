// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include <vector>

namespace bundle_icp {

/** Covariances of the poses of `problem`'s variable frames, in their order, given all its evidence:
 *  of rotation [rad] and position [m] along the axes of the world, relative to the frames that keep
 *  their pose, with points, calibration and depth errors as unknown as `problem` says.
 *
 *  A depth image takes part in all dense terms of its frame with the same noise: together they
 *  count for as much as its noise allows. */
std::vector<Matrix6d>
poseCovariances(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                const BundleAdjustmentOptions& options, const SparseModel& model);

} // namespace bundle_icp
