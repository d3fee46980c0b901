// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/pair_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

using namespace bundle_icp;

namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

Pairs
randomPairs(std::size_t num_frames, std::size_t count)
{
  std::mt19937 random(1);
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  while (pairs.size() < count) {
    const std::size_t i = random() % num_frames, j = random() % num_frames;
    if (i != j)
      pairs.emplace(std::max(i, j), std::min(i, j)); // in either order
  }
  return {pairs.begin(), pairs.end()};
}

} // namespace

TEST(PairBlocks, HoldEachPairOnceAndFramesThatHaveRoom)
{
  const Pairs pairs = randomPairs(50, 400);
  std::vector<std::size_t> bytes(50);
  std::mt19937 random(2);
  for (std::size_t& b : bytes)
    b = random() % 100;
  for (const std::size_t room : {200, 500, 2000}) {
    std::vector<int> times(pairs.size(), 0);
    for (const PairBlock& block : blocksOfPairs(bytes, pairs, room)) {
      std::size_t taken = 0;
      for (const std::size_t frame : block.frames)
        taken += bytes[frame];
      EXPECT_LE(taken, room);
      EXPECT_TRUE(std::is_sorted(block.frames.begin(), block.frames.end()));
      for (const std::size_t k : block.candidates) {
        ++times[k];
        for (const std::size_t frame : {pairs[k].first, pairs[k].second})
          EXPECT_TRUE(std::binary_search(block.frames.begin(), block.frames.end(), frame));
      }
    }
    EXPECT_EQ(times, std::vector<int>(pairs.size(), 1)) << room;
  }
}

TEST(PairBlocks, AreOneWhereAllHasRoomAndTwoFramesAlwaysHave)
{
  const Pairs pairs = randomPairs(20, 100);
  const std::vector<std::size_t> bytes(20, 10);
  for (const std::size_t room : {0, 200}) {
    const std::vector<PairBlock> blocks = blocksOfPairs(bytes, pairs, room);
    ASSERT_EQ(blocks.size(), 1u);
    EXPECT_EQ(blocks[0].candidates.size(), pairs.size());
  }
  for (const PairBlock& block : blocksOfPairs(bytes, pairs, 1))
    EXPECT_LE(block.frames.size(), 2u);
  EXPECT_TRUE(blocksOfPairs(bytes, {}, 1).empty());
}
