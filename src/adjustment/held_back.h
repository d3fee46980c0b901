// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include <set>
#include <vector>

namespace bundle_icp {

/** Observations of a point by `frames` that the adjustment of `problem` uses; none when the point
 *  takes no part. */
std::vector<Observation>
observationsThatTakePart(const BundleAdjustmentProblem& problem,
                         const std::set<std::size_t>& frames, const ScenePoint& point);

/** True when an observation is held back to test a calibration: a fifth of the observations in
 *  tracks of four or more, chosen by number. */
bool
isHeldBack(const ScenePoint& point, std::size_t index_in_track);

/** Robust cost, for each variable frame in their order, of the observations that isHeldBack(). Only
 *  points that took part in the adjustment of `problem` count. */
std::vector<double>
heldBackCost(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options, const SparseModel& model);

/** Standard deviations of calibration parameters, given all evidence of `problem`: from the inverse
 *  of the normal equations at the present state. 0 for parameters that are not adjusted. */
CalibrationVector
calibrationDeviations(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                      const BundleAdjustmentOptions& options, const SparseModel& model);

} // namespace bundle_icp
