// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/basin_search.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace bundle_icp {
namespace {

/** Poses of one answer differ by less [m, rad]. */
constexpr double ALIKE_DISTANCE = 0.05, ALIKE_ANGLE = 3 * M_PI / 180;
/** Rounds of starts, starts of one round, and poses that they lie about. */
constexpr int ROUNDS = 4, STARTS = 48;
constexpr std::size_t PARENTS = 4;
/** Largest turn of a start about each axis [rad]. */
constexpr double TURN = 12 * M_PI / 180;
/** What lies further from the first pose is no answer: in reaches, and in turns. */
constexpr double FARTHEST = 3;
/** Steps of a start, and of a basin that is followed to its bottom. */
constexpr int STEPS = 8, LAST_STEPS = 25;
/** Basins that are followed to their bottom. */
constexpr std::size_t FOLLOWED = 5;
/** More observed noise than this, in terms of the model's, does not make points lie on the target
 *  that are far from it. */
constexpr double LARGEST_SCALE = 2;
/** Distances that the coarse level allows for: while it moves, and when it is judged [m]. */
constexpr float MOVING = 0.1f, JUDGED = 0.01f;
/** No pose will be found with clearly more support than this. */
constexpr double ENOUGH_SUPPORT = 0.85;

class Search {
public:
  Search(AlignmentTerms& terms, const Pose& first, double reach)
  : terms_(terms), first_(first), reach_(reach), basins_{{first, 0}}
  {
  }

  void
  add(const Pose& start)
  {
    keep(judged(descend(start, 0, MOVING, STEPS), 0, JUDGED));
  }

  /** Starts about the best basins. */
  void
  spread()
  {
    const std::vector<Basin> parents(
        basins_.begin(), basins_.begin() + std::ptrdiff_t(std::min(PARENTS, basins_.size())));
    for (int k = 0; k < STARTS; ++k)
      add(parents[std::size_t(k) % parents.size()].pose * randomStart());
  }

  bool
  isDone() const
  {
    return basins_.front().support > ENOUGH_SUPPORT;
  }

  /** The best basins, followed to their bottom on a finer level. */
  std::vector<Basin>
  bottoms()
  {
    std::vector<Basin> found = std::move(basins_);
    found.resize(std::min(found.size(), FOLLOWED));
    basins_ = {{first_, 0}};
    for (const Basin& basin : found)
      keep(judged(descend(descend(basin.pose, 1, 0.03f, STEPS), 1, 0, LAST_STEPS), 1, 0));
    return basins_;
  }

private:
  Pose
  descend(Pose pose, std::size_t level, float misalignment, int steps)
  {
    terms_.useLevel(level, misalignment);
    for (int k = 0; k < steps; ++k) {
      const AlignmentTerms::Evaluation at = terms_.evaluate(pose);
      if (at.dense.matched < 6)
        break;
      pose = closestPose((motionAbout(terms_.center(), at.step.delta) * pose).matrix());
      if (at.step.delta.norm() < 1e-4)
        break;
    }
    return pose;
  }

  Basin
  judged(const Pose& pose, std::size_t level, float misalignment)
  {
    terms_.useLevel(level, misalignment);
    const double scale = terms_.evaluate(pose).scale;
    const Meeting meeting = terms_.meeting(pose, std::min(scale, LARGEST_SCALE));
    const double overlap = meeting.near / double(terms_.source().size());
    return {pose, overlap * meeting.near / std::max(1.0, meeting.near + meeting.against)};
  }

  /** Keeps the better of those that are alike, in descending order. */
  void
  keep(const Basin& basin)
  {
    const Pose moved = first_.inverse() * basin.pose;
    if (moved.translation().norm() > FARTHEST * reach_ || rotationAngle(moved) > FARTHEST * TURN)
      return;
    for (const Basin& other : basins_)
      if (other.support >= basin.support && areAlike(other.pose, basin.pose))
        return;
    basins_.erase(
        std::remove_if(basins_.begin(), basins_.end(),
                       [&](const Basin& other) { return areAlike(other.pose, basin.pose); }),
        basins_.end());
    const auto place = std::find_if(basins_.begin(), basins_.end(), [&](const Basin& other) {
      return other.support < basin.support;
    });
    basins_.insert(place, basin);
  }

  /** The same on every machine, unlike the distributions of the standard library. */
  Pose
  randomStart()
  {
    Vector6d delta;
    for (int k = 0; k < 6; ++k)
      delta[k] =
          (2 * double(random_()) / double(std::mt19937::max()) - 1) * (k < 3 ? TURN : reach_);
    return increment(delta);
  }

  AlignmentTerms& terms_;
  Pose first_;
  double reach_;
  std::mt19937 random_{1};
  std::vector<Basin> basins_; ///< best first
};

} // namespace

bool
areAlike(const Pose& a, const Pose& b)
{
  const Pose difference = a.inverse() * b;
  return difference.translation().norm() < ALIKE_DISTANCE &&
         rotationAngle(difference) < ALIKE_ANGLE;
}

std::vector<Basin>
findBasins(AlignmentTerms& terms, const Pose& first, const Pose& second, double reach)
{
  Search search(terms, first, reach);
  search.add(first);
  search.add(second);
  for (int round = 0; round < ROUNDS && !search.isDone(); ++round)
    search.spread();
  return search.bottoms();
}

} // namespace bundle_icp
