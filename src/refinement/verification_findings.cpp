// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/verification_findings.h"

#include "common/by_time.h"
#include "refinement/format_text.h"
#include "refinement/spread.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace bundle_icp {
namespace {

/** Share of doubtful frames from which the scan suffers in part. */
constexpr double SOME_FRAMES = 0.02;
/** Median share of depth that agrees, below which the scan contradicts itself. */
constexpr double MIN_SCAN_AGREEMENT = 0.7;
/** Median displacement by matches beyond which poses and images do not fit [sigma]. */
constexpr double MAX_SCAN_DISPLACEMENT = 1;
/** Share of contradicted pairs of good frames from which parts of the scan do not fit together. */
constexpr double SOME_PAIRS = 0.02, MANY_PAIRS = 0.1;
/** What no hand does, with a camera that still sees something: acceleration [m/s^2, rad/s^2]. */
constexpr double MAX_ACCELERATION = 50, MAX_TURNING = 200;
/** Frames farther apart than this say nothing of acceleration [s]. */
constexpr double MAX_GAP = 0.5;

/** Of the frames with a pose. */
struct Summary {
  double registered = 0, doubtful = 0, refuted = 0;
  std::optional<double> agreement; ///< median over those that were compared
  double displacement = 0;         ///< median
};

Summary
summarise(const std::vector<VerifiedFrame>& frames)
{
  Summary summary;
  std::vector<double> agreements, displacements;
  for (const VerifiedFrame& frame : frames) {
    if (frame.verdict == FrameVerdict::LEFT_OUT)
      continue;
    summary.registered += 1;
    summary.doubtful += frame.verdict == FrameVerdict::DOUBTFUL;
    summary.refuted += frame.refuted;
    if (frame.refuted)
      continue;
    if (frame.depth_agreement)
      agreements.push_back(*frame.depth_agreement);
    displacements.push_back(frame.displacement);
  }
  if (!agreements.empty())
    summary.agreement = medianOf(agreements);
  summary.displacement = medianOf(displacements);
  return summary;
}

/** Frames that a hand cannot have moved to and from in the time that the stamps say. */
std::size_t
countJumps(const ImageGraph& graph, const SparseModel& model,
           const std::vector<VerifiedFrame>& verified, std::size_t& compared)
{
  std::vector<std::size_t> frames = model.registeredFrames(0);
  frames.erase(std::remove_if(frames.begin(), frames.end(),
                              [&verified](std::size_t frame) { return verified[frame].refuted; }),
               frames.end());
  frames = byTime(graph, std::move(frames));
  std::size_t jumps = 0;
  for (std::size_t k = 1; k + 1 < frames.size(); ++k) {
    const double before = graph.timestamp(frames[k]) - graph.timestamp(frames[k - 1]);
    const double after = graph.timestamp(frames[k + 1]) - graph.timestamp(frames[k]);
    if (!(before > 0) || !(after > 0) || before > MAX_GAP || after > MAX_GAP)
      continue;
    ++compared;
    const Pose step_before =
        model.worldFromCamera(frames[k - 1]).inverse() * model.worldFromCamera(frames[k]);
    const Pose step_after =
        model.worldFromCamera(frames[k]).inverse() * model.worldFromCamera(frames[k + 1]);
    const Vector6d change = logarithm(step_after) / after - logarithm(step_before) / before;
    const double time = 0.5 * (before + after);
    jumps += change.head<3>().norm() > MAX_TURNING * time ||
             change.tail<3>().norm() > MAX_ACCELERATION * time;
  }
  return jumps;
}

void
addFrames(const Summary& summary, std::vector<Finding>& findings)
{
  const double share = summary.doubtful / summary.registered;
  if (summary.doubtful == 0)
    return;
  findings.push_back(
      {share >= MANY_FRAMES   ? Severity::FAULT
       : share >= SOME_FRAMES ? Severity::WARNING
                              : Severity::NOTE,
       "doubtful_frames",
       formatText("the poses of %.0f of %.0f frames are contradicted by other frames, or "
                  "supported by none",
                  summary.doubtful, summary.registered) +
           (summary.refuted > 0 ? formatText(", of which %.0f are left out", summary.refuted) : ""),
       {{"doubtful_frames", summary.doubtful},
        {"left_out_frames", summary.refuted},
        {"frames", summary.registered}},
       "report.json names them and says why; leave them out or record the place again"});
}

/** Frames that agree with most others, but not with some: parts of the scan in wrong places. */
void
addPairs(const PairCounts& pairs, std::vector<Finding>& findings)
{
  const double share = pairs.compared > 0 ? double(pairs.contradicted) / double(pairs.compared) : 0;
  if (share < SOME_PAIRS)
    return;
  findings.push_back({share >= MANY_PAIRS ? Severity::FAULT : Severity::WARNING,
                      "contradicted_pairs",
                      formatText("the matches of %zu of %zu pairs of frames contradict the poses",
                                 pairs.contradicted, pairs.compared),
                      {{"contradicted_pairs", double(pairs.contradicted)},
                       {"compared_pairs", double(pairs.compared)}},
                      "parts of the scan do not fit together, or something moves: record slower, "
                      "and where the scan comes back look at more of what was seen before"});
}

} // namespace

std::vector<Finding>
poseFindings(const ImageGraph& graph, const SparseModel& model,
             const std::vector<VerifiedFrame>& frames, const PairCounts& pairs, bool has_times)
{
  std::vector<Finding> findings;
  const Summary summary = summarise(frames);
  if (summary.registered == 0)
    return findings;
  addFrames(summary, findings);
  addPairs(pairs, findings);
  if (summary.agreement && *summary.agreement < MIN_SCAN_AGREEMENT)
    findings.push_back(
        {Severity::FAULT,
         "contradicting_depth",
         formatText(
             "only %.0f %% of the depth of a typical frame agrees with what other frames saw "
             "there, the rest lies in space that they looked through",
             100 * *summary.agreement),
         {{"median_agreeing_share", *summary.agreement}},
         "something moves with the camera or through the scene, or colour and depth do not belong "
         "together: mask it, or record without it"});
  if (summary.displacement > MAX_SCAN_DISPLACEMENT)
    findings.push_back({Severity::FAULT,
                        "contradicting_matches",
                        formatText("in a typical frame matched points contradict the poses by %.1f "
                                   "standard deviations",
                                   summary.displacement),
                        {{"median_displacement_sigmas", summary.displacement}},
                        "check intrinsics, the unit of depth and whether colour and depth belong "
                        "together"});
  std::size_t compared = 0;
  const std::size_t jumps = has_times ? countJumps(graph, model, frames, compared) : 0;
  if (jumps > 0)
    findings.push_back(
        {Severity::WARNING,
         "motion",
         formatText("at %zu of %zu frames the camera moves as no hand can, by the time "
                    "stamps",
                    jumps, compared),
         {{"jumps", double(jumps)}, {"compared_frames", double(compared)}},
         "check the time stamps of the recording"});
  return findings;
}

} // namespace bundle_icp
