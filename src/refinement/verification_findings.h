// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "refinement/verification.h"

#include <bundle_icp/model/sparse_model.h>

namespace bundle_icp {

/** Share of doubtful frames from which a scan is bad as a whole. */
constexpr double MANY_FRAMES = 0.2;

/** Pairs of frames whose matches were compared with the poses. */
struct PairCounts {
  std::size_t compared = 0, contradicted = 0;
};

/** What the verdicts of the frames, and their motion, say of the scan. */
std::vector<Finding>
poseFindings(const ImageGraph& graph, const SparseModel& model,
             const std::vector<VerifiedFrame>& frames, const PairCounts& pairs, bool has_times);

} // namespace bundle_icp
