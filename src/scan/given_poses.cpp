// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/given_poses.h"

#include "refinement/format_text.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {

bool
GivenPoses::isValid(std::string* error) const
{
  std::string reason;
  if (trajectory.empty())
    reason = "poses: the trajectory is empty";
  else if (!(std::isfinite(max_time_difference) && max_time_difference > 0))
    reason = "poses: max_time_difference must be finite and > 0";
  for (const TimedPose& pose : trajectory)
    if (!isRigid(pose.world_from_camera.matrix()))
      reason = formatText("poses: the pose at %.6f s is not a rigid motion", pose.timestamp);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

void
checkTimes(const GivenPoses& poses, const RGBDDataset& dataset)
{
  double first = dataset.timestamp(0), last = first;
  for (std::size_t i = 0; i < dataset.size(); ++i) {
    const double time = dataset.timestamp(i);
    if (poseAt(poses.trajectory, time, poses.max_time_difference))
      return;
    first = std::min(first, time);
    last = std::max(last, time);
  }
  throw BadArgumentException(
      poses.source + formatText(": no pose is within %.3g s of a frame; the times of the poses are "
                                "%.12g ... %.12g s, those of the frames %.12g ... %.12g s",
                                poses.max_time_difference, poses.trajectory.front().timestamp,
                                poses.trajectory.back().timestamp, first, last));
}

void
placeFrames(const GivenPoses& poses, ReconstructionResult& result)
{
  std::size_t placed = 0;
  for (FrameReport& frame : result.frames) {
    const std::optional<Pose> pose =
        poseAt(poses.trajectory, frame.timestamp, poses.max_time_difference);
    if (!pose) {
      frame.reason =
          formatText("no pose within %.3g s: ", poses.max_time_difference) + poses.source;
      continue;
    }
    ++placed;
    frame.registered = true;
    frame.component = 0;
    frame.verdict = FrameVerdict::UNCHECKED;
    frame.world_from_camera = frame.world_from_depth = *pose;
  }
  result.component_sizes = {placed};
  result.findings.push_back(
      {Severity::WARNING,
       "given_poses",
       formatText("%zu of %zu frames have a pose from ", placed, result.frames.size()) +
           poses.source + "; the poses are neither checked nor improved, and the world is theirs",
       {{"frames", double(placed)}},
       ""});
}

} // namespace bundle_icp
