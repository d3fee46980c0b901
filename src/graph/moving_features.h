// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/feature_matching.h>

#include <vector>

namespace bundle_icp {

/** Removes the pairs most of whose matches lie on things that move. Pairs of images that show two
 *  motions tell which features do; pairs that share nothing but the moving thing would place frames
 *  by it.
 *  \param num_frames frames that the pairs index */
void
removeMovingPairs(std::size_t num_frames, std::vector<FramePair>& pairs);

} // namespace bundle_icp
