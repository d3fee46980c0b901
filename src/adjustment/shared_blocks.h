// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "adjustment/adjustment_terms.h"
#include "adjustment/block_cholesky.h"

#include <vector>

namespace bundle_icp {

/** The observations of each frame that moves, by index into the terms' list. */
std::vector<std::vector<std::size_t>>
observationsOfFrames(const AdjustmentTerms& terms);

/** Blocks of the frames' reduced matrix that are not zero: two frames share one when they see a
 *  point together or are a dense pair.
 *  \param observations_of observationsOfFrames() */
BlockStructure
sharedBlocks(const AdjustmentTerms& terms,
             const std::vector<std::vector<std::size_t>>& observations_of, int num_threads);

} // namespace bundle_icp
