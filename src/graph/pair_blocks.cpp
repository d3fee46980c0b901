// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/pair_blocks.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace bundle_icp {
namespace {

/** Number of the group of each frame: two groups have room at once. */
std::vector<std::size_t>
groupsOf(const std::vector<std::size_t>& bytes, std::size_t max_bytes)
{
  std::vector<std::size_t> group_of;
  const bool have_room =
      max_bytes == 0 || std::accumulate(bytes.begin(), bytes.end(), std::size_t(0)) <= max_bytes;
  std::size_t group = 0, taken = 0;
  for (const std::size_t frame_bytes : bytes) {
    if (!have_room && taken > 0 && taken + frame_bytes > max_bytes / 2) {
      ++group;
      taken = 0;
    }
    taken += frame_bytes;
    group_of.push_back(group);
  }
  return group_of;
}

} // namespace

std::vector<PairBlock>
blocksOfPairs(const std::vector<std::size_t>& bytes,
              const std::vector<std::pair<std::size_t, std::size_t>>& pairs, std::size_t max_bytes)
{
  const std::vector<std::size_t> group_of = groupsOf(bytes, max_bytes);
  std::map<std::pair<std::size_t, std::size_t>, PairBlock> blocks;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    PairBlock& block = blocks[std::minmax(group_of[pairs[k].first], group_of[pairs[k].second])];
    block.candidates.push_back(k);
    block.frames.push_back(pairs[k].first);
    block.frames.push_back(pairs[k].second);
  }
  std::vector<PairBlock> result;
  for (auto& [groups, block] : blocks) {
    std::sort(block.frames.begin(), block.frames.end());
    block.frames.erase(std::unique(block.frames.begin(), block.frames.end()), block.frames.end());
    result.push_back(std::move(block));
  }
  return result;
}

} // namespace bundle_icp
