// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include <set>
#include <vector>

namespace bundle_icp {

/** Observations of a point by `images` that the adjustment of `problem` uses; none when the point
 *  takes no part. */
std::vector<Observation>
observationsThatTakePart(const BundleAdjustmentProblem& problem,
                         const std::set<std::size_t>& images, const ScenePoint& point);

} // namespace bundle_icp
