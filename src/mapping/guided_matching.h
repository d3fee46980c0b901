// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>

#include <vector>

namespace bundle_icp {

/** Matches registered images that share no edge: around where the poses predict a feature of
 *  one, those of the other are searched in a kd-tree, and what looks alike joins its track. Images
 *  whose descriptors were released take no part. The result does not depend on threads. */
void
matchByPrediction(const ImageGraph& graph, const std::vector<std::size_t>& images,
                  const TrackOptions& options, int num_threads, SparseModel& model);

} // namespace bundle_icp
