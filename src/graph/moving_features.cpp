// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/moving_features.h"

#include <algorithm>
#include <map>

namespace bundle_icp {
namespace {

/** Of each frame: by feature, the pairs in which it has the other motion less those in which it has
 *  that of the pair. */
using Votes = std::vector<std::map<int, int>>;

void
addVotes(const FramePair& pair, const std::vector<FeatureMatch>& matches, int vote, Votes& votes)
{
  for (const FeatureMatch& m : matches) {
    votes[pair.first][m.first] += vote;
    votes[pair.second][m.second] += vote;
  }
}

bool
moves(const Votes& votes, std::size_t frame, int feature)
{
  const auto found = votes[frame].find(feature);
  return found != votes[frame].end() && found->second > 0;
}

} // namespace

void
removeMovingPairs(std::size_t num_frames, std::vector<FramePair>& pairs)
{
  Votes votes(num_frames);
  for (const FramePair& pair : pairs)
    if (!pair.matches_of_other_motion.empty()) {
      addVotes(pair, pair.matches, -1, votes);
      addVotes(pair, pair.matches_of_other_motion, 1, votes);
    }
  const auto is_of_moving = [&](const FramePair& pair) {
    const auto moving =
        std::count_if(pair.matches.begin(), pair.matches.end(), [&](const FeatureMatch& m) {
          return moves(votes, pair.first, m.first) || moves(votes, pair.second, m.second);
        });
    return 2 * std::size_t(moving) > pair.matches.size();
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_of_moving), pairs.end());
}

} // namespace bundle_icp
