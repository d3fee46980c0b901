// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/shared_blocks.h"

#include "common/parallel.h"

#include <algorithm>

namespace bundle_icp {

std::vector<std::vector<std::size_t>>
observationsOfFrames(const AdjustmentTerms& terms)
{
  std::vector<std::vector<std::size_t>> result(terms.num_moving);
  for (std::size_t k = 0; k < terms.observations.size(); ++k)
    if (const std::size_t frame = std::size_t(terms.observations[k].frame); frame < result.size())
      result[frame].push_back(k);
  return result;
}

BlockStructure
sharedBlocks(const AdjustmentTerms& terms,
             const std::vector<std::vector<std::size_t>>& observations_of, int num_threads)
{
  std::vector<std::vector<int>> columns(terms.num_moving);
  for (std::size_t c = 0; c < columns.size(); ++c)
    columns[c].push_back(int(c));
  for (const AdjustedPair& pair : terms.pairs)
    if (const auto [column, row] = std::minmax(pair.first, pair.second); row < int(columns.size()))
      columns[std::size_t(column)].push_back(row);
  parallelFor(columns.size(), num_threads, {}, [&](std::size_t c) {
    std::vector<char> shared(columns.size(), 0);
    for (const int row : columns[c])
      shared[std::size_t(row)] = 1;
    for (const std::size_t k : observations_of[c]) {
      const std::size_t p = std::size_t(terms.observations[k].point);
      for (std::size_t o = terms.first_observation[p]; o < terms.first_observation[p + 1]; ++o)
        if (terms.observations[o].frame < int(columns.size()))
          shared[std::size_t(terms.observations[o].frame)] = 1;
    }
    columns[c].clear();
    for (std::size_t r = c; r < columns.size(); ++r)
      if (shared[r])
        columns[c].push_back(int(r));
  });
  return BlockStructure(columns);
}

} // namespace bundle_icp
