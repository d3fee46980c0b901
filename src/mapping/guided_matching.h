// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

#include <vector>

namespace bundle_icp {

/** Matches registered frames that share no edge. The poses predict where a feature of one frame
 *  appears in the other; a kd-tree finds the features around this place, and similar features join
 *  the track. Frames without descriptors take no part. The result does not depend on threads. */
void
matchByPrediction(const ImageGraph& graph, const std::vector<std::size_t>& frames,
                  const TrackOptions& options, int num_threads, SparseModel& model);

} // namespace bundle_icp
