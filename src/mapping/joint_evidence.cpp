// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/joint_evidence.h"

#include <algorithm>
#include <utility>

namespace bundle_icp {
namespace {

/** For a motion that is not refined: it is off by some centimetres. */
constexpr DepthComparisonOptions ROUGH{16, 0.05};
/** Frames that are aligned with the other part. */
constexpr std::size_t MAX_ALIGNED = 4;
/** A frame that has less of its depth on the other part is not held by it. */
constexpr double MIN_OVERLAP = 0.25;
/** Poses of a part that lie nearer are one place [m, rad]. */
constexpr double SAME_DISTANCE = 0.15, SAME_ANGLE = 6 * M_PI / 180;

double
gridSize(const DepthView& view, const DepthComparisonOptions& options)
{
  const int step = std::max(1, view.camera.width / options.pixels_along_width);
  return double(view.camera.width / step) * double(view.camera.height / step);
}

} // namespace

bool
areSamePlace(const SparseModel& model, const Part& second, const Pose& a, const Pose& b)
{
  if (rotationAngle(a.inverse() * b) > SAME_ANGLE)
    return false;
  return std::all_of(second.begin(), second.end(), [&](std::size_t frame) {
    const Eigen::Vector3d position = model.worldFromCamera(frame).translation();
    return (a * position - b * position).norm() < SAME_DISTANCE;
  });
}

std::vector<Neighbour>
framesSharingDepth(const SparseModel& model, const DepthViewProvider& depth_views,
                   std::size_t frame, const Pose& world_from_depth, const Part& frames,
                   double min_share)
{
  const auto view = depth_views(frame, model);
  std::vector<Neighbour> sharing;
  for (const std::size_t other : frames) {
    const Pose other_from_view = model.worldFromDepth(other).inverse() * world_from_depth;
    const DepthAgreement agreement =
        compareDepth(*view, *depth_views(other, model), other_from_view, ROUGH);
    if (agreement.agree > min_share * gridSize(*view, ROUGH))
      sharing.push_back({other, std::size_t(agreement.agree)});
  }
  std::stable_sort(sharing.begin(), sharing.end(),
                   [](const Neighbour& a, const Neighbour& b) { return a.matches > b.matches; });
  return sharing;
}

JointEvidence
JointJudge::measure(const Part& first, const Part& second, const Pose& first_from_second,
                    const DepthComparisonOptions& options) const
{
  JointEvidence evidence;
  evidence.first_from_second = first_from_second;
  for (const std::size_t b : second) {
    const auto view = depth_views_(b, model_);
    const Pose world_from_view = first_from_second * model_.worldFromDepth(b);
    double most = 0;
    for (const std::size_t a : first) {
      const auto other = depth_views_(a, model_);
      const Pose other_from_view = model_.worldFromDepth(a).inverse() * world_from_view;
      const DepthAgreement forth = compareDepth(*view, *other, other_from_view, options);
      const DepthAgreement back = compareDepth(*other, *view, other_from_view.inverse(), options);
      evidence.depth += forth;
      evidence.depth += back;
      most = std::max(most, forth.agree / gridSize(*view, options));
      evidence.overlap = std::max(evidence.overlap, back.agree / gridSize(*other, options));
    }
    evidence.shared += most;
    evidence.overlap = std::max(evidence.overlap, most);
  }
  return evidence;
}

JointEvidence
JointJudge::measureRoughly(const Part& first, const Part& second,
                           const Pose& first_from_second) const
{
  return measure(first, second, first_from_second, ROUGH);
}

void
JointJudge::addCandidates(const Part& from, const Part& to, const Pose& to_from_from,
                          bool is_of_first, std::vector<Candidate>& candidates) const
{
  for (const std::size_t frame : from) {
    std::vector<Neighbour> sharing = framesSharingDepth(
        model_, depth_views_, frame, to_from_from * model_.worldFromDepth(frame), to, 0);
    if (sharing.empty())
      continue;
    sharing.resize(std::min(sharing.size(), max_views_));
    candidates.push_back(
        {{frame, sharing, to_from_from * model_.worldFromCamera(frame), 1}, is_of_first});
  }
}

JointEvidence
JointJudge::refine(const Part& first, const Part& second, const Pose& first_from_second) const
{
  std::vector<Candidate> candidates;
  addCandidates(second, first, first_from_second, false, candidates);
  addCandidates(first, second, first_from_second.inverse(), true, candidates);
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.frame.neighbours.front().matches > b.frame.neighbours.front().matches;
  });
  candidates.resize(std::min(candidates.size(), MAX_ALIGNED));
  std::vector<Pose> held;
  JointEvidence best;
  for (const Candidate& candidate : candidates) {
    const BundleICPResult result = registrar_.alignDepth(model_, candidate.frame);
    if (!hasConverged(result.status))
      continue;
    const Pose motion =
        result.world_from_source * model_.worldFromDepth(candidate.frame.index).inverse();
    const Pose refined = candidate.is_of_first ? motion.inverse() : motion;
    if (result.overlap >= MIN_OVERLAP && result.degenerate_directions.empty())
      held.push_back(refined);
    const JointEvidence evidence = measure(first, second, refined, {});
    if (evidence.support() > best.support())
      best = evidence;
  }
  best.held = std::size_t(std::count_if(held.begin(), held.end(), [&](const Pose& pose) {
    return areSamePlace(model_, second, pose, best.first_from_second);
  }));
  return best;
}

} // namespace bundle_icp
