// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "adjustment/adjustment_terms.h"
#include "adjustment/block_cholesky.h"

#include <vector>

namespace bundle_icp {

/** The observations of each image that moves, by index into the terms' list. */
std::vector<std::vector<std::size_t>>
observationsOfImages(const AdjustmentTerms& terms);

/** Blocks of the images' reduced matrix that are not zero: two images share one when they see a
 *  point together or are a dense pair.
 *  \param observations_of observationsOfImages() */
BlockStructure
sharedBlocks(const AdjustmentTerms& terms,
             const std::vector<std::vector<std::size_t>>& observations_of, int num_threads);

} // namespace bundle_icp
