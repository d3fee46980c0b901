// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/impl/point_alignment.h>

#include "registration/basin_search.h"

#include <pcl/console/print.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Misalignment that the coarse levels allow for, tried in this order [m]: wide kernels
 * see far structures pull, narrow ones are not led astray by clutter. */
constexpr float MISALIGNMENTS[] = {0.1f, 0.03f, 0.3f};
/** Largest misalignment that a pose from visual evidence leaves [m]. */
constexpr double VISUAL_MISALIGNMENT = 0.03;
/** No further kernel is tried once this share of the source lies on the target. */
constexpr double ENOUGH_OVERLAP = 0.75;
/** Share of the iterations that one run of a coarse level may spend, and all of them together. */
constexpr double COARSE_BUDGET = 0.15, ALL_COARSE_BUDGET = 0.75;
/** More observed noise than this, in terms of the model's, does not make points lie on the target
 * that are far from it. */
constexpr double LARGEST_SCALE = 2;
/** Clouds meet when at least this share of the source lies on the target, and clearly more speaks
 * for the pose than against it. On pairs of three recordings, right poses have an agreement of 0.75
 * and more but for steps of half a metre (0.55), wrong ones that ICP was led to 0.5 and less. */
constexpr double MIN_OVERLAP = 0.1, MIN_AGREEMENT = 0.6;
/** Without visual evidence an answer with less may lie in a basin beside the right one. Frames
 * against what they see have more. */
constexpr double CLEAR_OVERLAP = 0.7, CLEAR_AGREEMENT = 0.92;
/** A pose with less is not trusted, nor one when another pose has as much support but for this. */
constexpr double TRUSTED_OVERLAP = 0.25, TRUSTED_AGREEMENT = 0.75, TRUSTED_LEAD = 0.1;

/** Algorithm 1 of the paper, lines 4 to 7: from coarse levels to fine ones. */
class Aligner {
public:
  Aligner(const AlignmentProblem& problem, const Pose& start)
  : problem_(problem), terms_(problem), pose_(start), initial_pose_(start)
  {
  }

  bool
  prepare();
  BundleICPResult
  invalid();
  void
  approach();
  bool
  refine();
  bool
  lookAround(bool done);
  BundleICPResult
  finish(bool done);

private:
  using Evaluation = AlignmentTerms::Evaluation;

  double
  overlapOnLevel(std::size_t level);
  bool
  runLevel(std::size_t level, float misalignment);
  bool
  converged(const Pose& motion, std::size_t level) const;
  void
  iterate(const Evaluation& at);
  void
  notify() const;
  bool
  isGuessTrusted() const;
  void
  measureMeeting(const Evaluation& at);
  BundleICPStatus
  meetingStatus(const Evaluation& at) const;
  void
  report(const Evaluation& at);
  void
  reportInformation(const Evaluation& at);
  bool
  hasVisualEvidence() const
  {
    return !problem_.visual.source.empty();
  }

  const AlignmentProblem& problem_;
  AlignmentTerms terms_;
  Pose pose_, initial_pose_;
  bool ambiguous_ = false; ///< another pose has as much support
  BundleICPResult out_;
};

/** \return false when there is nothing to align. */
bool
Aligner::prepare()
{
  const bool usable = terms_.prepare(pose_);
  out_.projective = terms_.projective();
  out_.visual_initial_pose = hasVisualEvidence();
  return usable;
}

BundleICPResult
Aligner::invalid()
{
  PCL_ERROR("[bundle_icp::BundleICP::align] The source has no finite point\n");
  out_.status = BundleICPStatus::INVALID_INPUT;
  out_.world_from_source = pose_;
  return out_;
}

bool
Aligner::converged(const Pose& motion, std::size_t level) const
{
  // A coarse level only prepares the next.
  const double loose = level + 1 < terms_.numLevels() ? 100 : 1;
  const double cosine = std::cos(rotationAngle(motion));
  const Eigen::Vector3d moved = motion * terms_.center() - terms_.center();
  return moved.squaredNorm() <= loose * problem_.translation_epsilon &&
         1 - cosine <= loose * (1 - problem_.rotation_epsilon);
}

void
Aligner::iterate(const Evaluation& at)
{
  out_.last_step = motionAbout(terms_.center(), at.step.delta);
  pose_ = closestPose((out_.last_step * pose_).matrix());
  ++out_.iterations;
  if (problem_.on_iteration)
    notify();
}

void
Aligner::notify() const
{
  const std::vector<int>& matched = terms_.matches().target;
  std::vector<int> source, target;
  for (std::size_t i = 0; i < terms_.source().size(); ++i)
    if (matched[i] >= 0) {
      source.push_back(terms_.source().index[i]);
      target.push_back(matched[i]);
    }
  problem_.on_iteration(pose_, source, target);
}

/** Share of the level's points that lie on the target within the expected noise. */
double
Aligner::overlapOnLevel(std::size_t level)
{
  terms_.useLevel(level, 0);
  terms_.evaluate(pose_);
  return double(accumulate(terms_.matches(), 1, problem_.num_threads).inliers) /
         double(std::max<std::size_t>(1, terms_.source().size()));
}

/** The coarse levels: brings the pose near enough for the last one. */
void
Aligner::approach()
{
  terms_.renderAgain(pose_);
  const std::size_t coarse = terms_.numLevels() - 1;
  const Pose start = pose_;
  Pose best = start;
  double best_overlap = -1;
  const double limit = hasVisualEvidence()
                           ? std::min(VISUAL_MISALIGNMENT, problem_.max_misalignment)
                           : problem_.max_misalignment;
  for (const float misalignment : MISALIGNMENTS) {
    if (terms_.projective() && misalignment > float(limit))
      continue;
    pose_ = start;
    for (std::size_t level = 0; level < coarse; ++level)
      runLevel(level, level == 0 ? misalignment : std::min(misalignment, 0.03f));
    if (!terms_.projective())
      return;
    const double overlap = overlapOnLevel(coarse - 1);
    if (overlap > best_overlap) {
      best_overlap = overlap;
      best = pose_;
    }
    if (overlap >= ENOUGH_OVERLAP)
      break;
  }
  pose_ = best;
}

/** Iterates on one level. \return true when it converged within the budget. */
bool
Aligner::runLevel(std::size_t level, float misalignment)
{
  const bool last = level + 1 == terms_.numLevels();
  terms_.useLevel(level, misalignment);
  const int budget = last
                         ? problem_.max_iterations
                         : std::min(int(ALL_COARSE_BUDGET * problem_.max_iterations),
                                    out_.iterations + int(COARSE_BUDGET * problem_.max_iterations));
  double last_mean = -1;
  while (out_.iterations < budget) {
    const Evaluation at = terms_.evaluate(pose_);
    if (at.dense.matched < 6)
      return false;
    iterate(at);
    const double mean = at.dense.squared_error / std::max(1e-300, at.dense.weight_metric);
    const bool settled = last_mean >= 0 && problem_.fitness_epsilon > 0 &&
                         std::abs(mean - last_mean) < problem_.fitness_epsilon * last_mean;
    last_mean = mean;
    if (settled || converged(out_.last_step, level))
      return true;
  }
  return false;
}

/** Whether the start is as good as a pose that passes for right. */
bool
Aligner::isGuessTrusted() const
{
  return hasVisualEvidence() || problem_.max_misalignment <= VISUAL_MISALIGNMENT;
}

void
Aligner::measureMeeting(const Evaluation& at)
{
  const Meeting meeting = terms_.meeting(pose_, std::min(at.scale, LARGEST_SCALE));
  out_.inliers = std::size_t(meeting.near);
  out_.overlap = meeting.near / double(terms_.source().size());
  out_.agreement = meeting.near / std::max(1.0, meeting.near + meeting.against);
}

/** Where the first answer is not clear: the best of all answers from about the start and this one,
 *  and whether a second one is as good. \return whether the last level converged */
bool
Aligner::lookAround(bool done)
{
  if (!terms_.projective() || isGuessTrusted())
    return done;
  measureMeeting(terms_.evaluate(pose_));
  if (out_.overlap >= CLEAR_OVERLAP && out_.agreement >= CLEAR_AGREEMENT)
    return done;
  const std::vector<Basin> basins =
      findBasins(terms_, initial_pose_, pose_, problem_.max_misalignment);
  terms_.useLevel(terms_.numLevels() - 1, 0);
  const Basin& best = basins.front();
  if (!areAlike(best.pose, pose_)) {
    pose_ = best.pose;
    out_.iterations = 0;
    done = refine();
  }
  ambiguous_ = std::any_of(basins.begin(), basins.end(), [&](const Basin& other) {
    return other.support > best.support - TRUSTED_LEAD && !areAlike(other.pose, pose_);
  });
  return done;
}

/** The status of a pose that ICP has found. */
BundleICPStatus
Aligner::meetingStatus(const Evaluation& at) const
{
  if (out_.overlap < MIN_OVERLAP || out_.agreement < MIN_AGREEMENT)
    return BundleICPStatus::NO_OVERLAP;
  const bool open = !at.step.degenerate.empty();
  if (!isGuessTrusted() && (ambiguous_ || open || out_.overlap < TRUSTED_OVERLAP ||
                            (terms_.projective() && out_.agreement < TRUSTED_AGREEMENT)))
    return BundleICPStatus::LOW_OVERLAP;
  return out_.status;
}

void
Aligner::report(const Evaluation& at)
{
  BundleICPResult& result = out_;
  result.renderings = terms_.renderings();
  measureMeeting(at);
  if (hasConverged(result.status))
    result.status = meetingStatus(at);
  result.rmse = std::sqrt(at.dense.squared_inliers / std::max<double>(1, double(result.inliers)));
  const VisualSystem visual = terms_.visualTerms(pose_);
  result.visual_inliers = visual.inliers;
  result.visual_rmse =
      std::sqrt(visual.squared_inliers / std::max<double>(1, double(visual.inliers)));
  reportInformation(at);
}

/** From motions about the centre to motions about the origin of the world. */
void
Aligner::reportInformation(const Evaluation& at)
{
  BundleICPResult& result = out_;
  Matrix6d to_center = Matrix6d::Identity(), to_origin = to_center;
  to_center.bottomLeftCorner<3, 3>() = -crossMatrix(terms_.center());
  to_origin.bottomLeftCorner<3, 3>() = crossMatrix(terms_.center());
  result.information = to_center.transpose() * terms_.information(at) * to_center;
  for (const Vector6d& direction : at.step.degenerate)
    result.degenerate_directions.push_back((to_origin * direction).normalized());
  result.dense_pose = motionAbout(terms_.center(), at.step.dense_delta) * pose_;
}

/** The last levels, with the virtual depth rendered anew as the pose moves.
 *  \return true when the last one converged within the iterations. */
bool
Aligner::refine()
{
  const std::size_t last = terms_.numLevels() - 1;
  terms_.renderAgain(pose_);
  // Most of the way at a quarter of the cost; the last level then has little left to do.
  if (terms_.projective())
    runLevel(last - 1, 0);
  bool done = runLevel(last, 0);
  while (done && terms_.renderAgain(pose_))
    done = runLevel(last, 0);
  return done;
}

/** The verdict, and the pose that it leaves. */
BundleICPResult
Aligner::finish(bool done)
{
  BundleICPStatus& status = out_.status;
  Evaluation at = terms_.evaluate(pose_);
  status = done ? BundleICPStatus::CONVERGED : BundleICPStatus::MAX_ITERATIONS;
  if (at.dense.matched < 6)
    status = BundleICPStatus::TOO_FEW_CORRESPONDENCES;
  else if (hasVisualEvidence() &&
           agreesLess(terms_.visualTerms(pose_), terms_.visualTerms(initial_pose_)))
    status = BundleICPStatus::REFINEMENT_REJECTED;
  if (!hasConverged(status)) {
    pose_ = initial_pose_;
    at = terms_.evaluate(pose_);
  }
  out_.world_from_source = pose_;
  report(at);
  return out_;
}

} // namespace

BundleICPResult
alignPoints(const AlignmentProblem& problem, const Pose& start)
{
  Aligner aligner(problem, start);
  if (!aligner.prepare())
    return aligner.invalid();
  aligner.approach();
  const bool done = aligner.lookAround(aligner.refine());
  return aligner.finish(done);
}

} // namespace bundle_icp
