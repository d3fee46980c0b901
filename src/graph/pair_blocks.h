// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace bundle_icp {

/** Pairs of frames that are matched together. */
struct PairBlock {
  std::vector<std::size_t> frames;     ///< of all pairs, ascending
  std::vector<std::size_t> candidates; ///< indices of the pairs, ascending
};

/** Divides pairs into blocks whose frames take no more than `max_bytes` at once; two frames always
 *  have room. Blocks that follow each other share frames. One block where all have room.
 *  \param bytes that each frame takes
 *  \param max_bytes 0 = no limit */
std::vector<PairBlock>
blocksOfPairs(const std::vector<std::size_t>& bytes,
              const std::vector<std::pair<std::size_t, std::size_t>>& pairs, std::size_t max_bytes);

} // namespace bundle_icp
