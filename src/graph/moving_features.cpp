// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/moving_features.h"

#include <algorithm>
#include <map>
#include <set>

namespace bundle_icp {
namespace {

/** Share of the pairs that must show two motions. */
constexpr double LEAST_SHARE = 0.05;

/** Share of the image that matches cover, in cells of a grid. */
std::size_t
coveredCells(const Features& features, const std::vector<FeatureMatch>& matches,
             const CameraIntrinsics& camera)
{
  constexpr int columns = 16, rows = 12;
  std::set<std::pair<int, int>> cells;
  for (const FeatureMatch& m : matches) {
    const Eigen::Vector2f& pixel = features.pixels[std::size_t(m.first)];
    cells.emplace(int(pixel.x()) * columns / camera.width, int(pixel.y()) * rows / camera.height);
  }
  return cells.size();
}

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

Votes
voteForFeatures(std::size_t num_frames, const std::vector<FramePair>& pairs)
{
  Votes votes(num_frames);
  for (const FramePair& pair : pairs)
    if (!pair.matches_of_other_motion.empty()) {
      addVotes(pair, pair.matches, -1, votes);
      addVotes(pair, pair.matches_of_other_motion, 1, votes);
    }
  return votes;
}

} // namespace

void
separateMotions(const std::vector<const Features*>& features, const CameraIntrinsics& camera,
                std::vector<FramePair>& pairs)
{
  const auto two = std::count_if(pairs.begin(), pairs.end(), [](const FramePair& pair) {
    return !pair.matches_of_other_motion.empty();
  });
  if (double(two) <= LEAST_SHARE * double(pairs.size())) {
    for (FramePair& pair : pairs) {
      pair.matches_of_other_motion.clear();
      pair.matches_of_other_motion.shrink_to_fit();
    }
    return;
  }
  for (FramePair& pair : pairs) {
    const Features& first = *features[pair.first];
    if (coveredCells(first, pair.matches_of_other_motion, camera) >
        coveredCells(first, pair.matches, camera)) {
      std::swap(pair.matches, pair.matches_of_other_motion);
      std::swap(pair.first_from_second, pair.other_first_from_second);
    }
  }
  const Votes votes = voteForFeatures(features.size(), pairs);
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
