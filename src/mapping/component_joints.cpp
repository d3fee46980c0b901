// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/component_joints.h"

#include "common/parallel.h"
#include "mapping/joint_images.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace bundle_icp {
namespace {

/** Parts that are looked at: the largest. */
constexpr std::size_t MAX_PARTS = 20;
/** Frames of a part that are looked at. */
constexpr std::size_t MAX_FRAMES = 60;
/** Fewest matches that make a motion worth a look. */
constexpr std::size_t FEWEST_MATCHES = 4;
/** Motions by shape that are measured, and those of either kind that are refined. */
constexpr std::size_t MAX_BY_SHAPE = 150, MAX_REFINED = 12;

/** Depth that agrees less speaks against a joint, and against a place that rivals it. Right motions
 *  leave a few pixels at edges; a wrong one puts surfaces into space that frames looked through. */
constexpr double MIN_AGREEMENT = 0.95, MIN_RIVAL_AGREEMENT = 0.9;
/** So many matches of two frames that agree with the joint are no chance. */
constexpr std::size_t ENOUGH_MATCHES = 6;
/** Largest share of a frame's depth that the parts have in common, at least: with matches, and
 *  where shape alone speaks. */
constexpr double MIN_OVERLAP = 0.25, MIN_OVERLAP_ALONE = 0.5;
/** Frames that depth alone has to hold. */
constexpr std::size_t MIN_HELD = 1, MIN_HELD_ALONE = 2;
/** Support of the best other place, at most, as a share of that of the joint. */
constexpr double MAX_RUNNER_UP = 0.7, MAX_RUNNER_UP_ALONE = 0.5;

Part
someOf(const Part& part)
{
  const std::size_t step = (part.size() + MAX_FRAMES - 1) / MAX_FRAMES;
  Part some;
  for (std::size_t k = 0; k < part.size(); k += step)
    some.push_back(part[k]);
  return some;
}

bool
isBeyondDoubt(const JointEvidence& joint, double runner_up_support)
{
  const bool alone = joint.matches < ENOUGH_MATCHES;
  return joint.agreement() >= MIN_AGREEMENT &&
         joint.overlap >= (alone ? MIN_OVERLAP_ALONE : MIN_OVERLAP) &&
         joint.held >= (alone ? MIN_HELD_ALONE : MIN_HELD) &&
         runner_up_support <= (alone ? MAX_RUNNER_UP_ALONE : MAX_RUNNER_UP) * joint.support();
}

/** The best supported of those that shape suggests, and of those that matches do. */
std::vector<JointEvidence>
mostPromising(std::vector<JointEvidence> motions)
{
  std::stable_sort(
      motions.begin(), motions.end(),
      [](const JointEvidence& a, const JointEvidence& b) { return a.support() > b.support(); });
  std::vector<JointEvidence> best;
  std::size_t by_shape = 0, by_matches = 0;
  for (const JointEvidence& motion : motions)
    if (motion.support() > 0 && (motion.matches > 0 ? by_matches : by_shape)++ < MAX_REFINED)
      best.push_back(motion);
  return best;
}

} // namespace

/** Largest first. */
std::vector<Part>
ComponentJoiner::findParts(const SparseModel& model) const
{
  std::map<int, Part> components;
  std::vector<Part> parts;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (model.isRegistered(i))
      components[model.component(i)].push_back(i);
    else if (graph_.exclusion(i).rfind("blurred", 0) != 0)
      parts.push_back({i});
  for (auto& [number, frames] : components)
    parts.push_back(std::move(frames));
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.size() > b.size(); });
  parts.resize(std::min(parts.size(), MAX_PARTS));
  return parts;
}

const PartShape&
ComponentJoiner::shapeOf(const SparseModel& model, const Part& part)
{
  const auto found = shapes_.find(part);
  return found != shapes_.end()
             ? found->second
             : shapes_.emplace(part, partShape(model, depth_views_, part)).first->second;
}

/** Motions that few matches of two frames support: fewer than make an edge of the graph. */
void
ComponentJoiner::addMatchingMotions(const SparseModel& model, const Part& first, const Part& second,
                                    std::vector<JointEvidence>& motions) const
{
  Part frames = first;
  frames.insert(frames.end(), second.begin(), second.end());
  std::vector<const Features*> features;
  for (const std::size_t frame : frames)
    features.push_back(&graph_.features(frame));
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < first.size(); ++a)
    for (std::size_t b = first.size(); b < frames.size(); ++b)
      pairs.emplace_back(a, b);
  MatchingOptions matching;
  matching.min_matches = FEWEST_MATCHES;
  matching.num_threads = options_.num_threads;
  for (const FramePair& pair : matchPairs(features, graph_.camera(), pairs, matching)) {
    const Pose& world = model.worldFromCamera(frames[pair.first]);
    const Pose other = model.worldFromCamera(frames[pair.second]).inverse();
    JointEvidence motion;
    motion.first_from_second = world * pair.first_from_second * other;
    motion.matches = pair.matches.size();
    motions.push_back(motion);
    if (pair.matches_of_other_motion.empty())
      continue;
    motion.first_from_second = world * pair.other_first_from_second * other;
    motion.matches = pair.matches_of_other_motion.size();
    motions.push_back(motion);
  }
}

/** Motions that shape or matches suggest, with what depth says of each before it is refined. */
std::vector<JointEvidence>
ComponentJoiner::hypotheses(const SparseModel& model, const JointJudge& judge, const Part& first,
                            const Part& second)
{
  std::vector<JointEvidence> motions;
  addMatchingMotions(model, first, second, motions);
  for (const Pose& motion :
       motionsByShape(shapeOf(model, first), shapeOf(model, second), MAX_BY_SHAPE)) {
    motions.emplace_back();
    motions.back().first_from_second = motion;
  }
  parallelFor(motions.size(), options_.num_threads, {}, [&](std::size_t k) {
    const std::size_t matches = motions[k].matches;
    motions[k] = judge.measureRoughly(first, second, motions[k].first_from_second);
    motions[k].matches = matches;
  });
  return motions;
}

/** The best motion, if it is beyond doubt. */
std::optional<JointEvidence>
ComponentJoiner::findJoint(const SparseModel& model, const Part& first, const Part& second,
                           double& runner_up_support)
{
  const JointJudge judge(model, depth_views_, registrar_, options_.registration.max_views);
  std::vector<JointEvidence> motions = mostPromising(hypotheses(model, judge, first, second));
  parallelFor(motions.size(), options_.num_threads, {}, [&](std::size_t k) {
    const std::size_t matches = motions[k].matches;
    const Pose start = motions[k].first_from_second;
    motions[k] = judge.refine(first, second, start);
    if (areSamePlace(model, second, start, motions[k].first_from_second))
      motions[k].matches = matches;
  });
  motions.erase(std::remove_if(motions.begin(), motions.end(),
                               [](const JointEvidence& motion) {
                                 return motion.agreement() < MIN_RIVAL_AGREEMENT;
                               }),
                motions.end());
  const auto best = std::max_element(
      motions.begin(), motions.end(),
      [](const JointEvidence& a, const JointEvidence& b) { return a.support() < b.support(); });
  if (best == motions.end())
    return std::nullopt;
  JointEvidence joint = *best;
  runner_up_support = 0;
  for (const JointEvidence& motion : motions)
    if (areSamePlace(model, second, motion.first_from_second, joint.first_from_second))
      joint.matches = std::max(joint.matches, motion.matches);
    else
      runner_up_support = std::max(runner_up_support, motion.support());
  if (!isBeyondDoubt(joint, runner_up_support) ||
      compareImages(graph_, model, depth_views_, first, second, joint.first_from_second)
          .contradicts())
    return std::nullopt;
  return joint;
}

/** Moves the second part into the world of the first. */
MadeJoint
ComponentJoiner::join(const Part& first, const Part& second, const JointEvidence& evidence,
                      double runner_up_support, SparseModel& model) const
{
  MadeJoint joint;
  joint.component = model.component(first.front());
  joint.moved = second;
  joint.report = {first.size(),         second.size(),    evidence.held,      evidence.overlap,
                  evidence.agreement(), evidence.matches, evidence.support(), runner_up_support};
  const bool is_component = model.isRegistered(second.front());
  if (is_component)
    model.transform(model.component(second.front()), evidence.first_from_second);
  for (const std::size_t frame : second)
    if (is_component)
      model.registerFrame(frame, model.worldFromCamera(frame), joint.component);
    else
      model.registerFrame(graph_, frame, evidence.first_from_second * model.worldFromCamera(frame),
                          joint.component, options_.tracks);
  return joint;
}

std::optional<MadeJoint>
ComponentJoiner::joinNext(SparseModel& model)
{
  const std::vector<Part> parts = findParts(model);
  for (std::size_t i = 0; i < parts.size() && parts[i].size() > 1; ++i) {
    const Part* second = nullptr;
    JointEvidence best;
    double best_runner_up = 0;
    for (std::size_t j = i + 1; j < parts.size(); ++j) {
      if (refused_.count({parts[i], parts[j]}))
        continue;
      double runner_up = 0;
      const auto joint = findJoint(model, someOf(parts[i]), someOf(parts[j]), runner_up);
      if (!joint)
        refused_.insert({parts[i], parts[j]});
      else if (!second || joint->support() > best.support()) {
        second = &parts[j];
        best = *joint;
        best_runner_up = runner_up;
      }
    }
    if (second)
      return join(parts[i], *second, best, best_runner_up, model);
  }
  return std::nullopt;
}

} // namespace bundle_icp
