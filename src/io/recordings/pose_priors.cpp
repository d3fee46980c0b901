// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/pose_priors.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>

namespace bundle_icp {
namespace {

/** What the recording's device estimated. Measured truth is no prior: it would hide what the
 *  reconstruction is worth. */
const Trajectory&
devicePoses(const std::string& folder, const Recording& recording)
{
  if (recording.ground_truth.empty())
    throw IOException(folder + ": the recording (" + recording.format +
                      ") brings no poses that could be a prior");
  if (recording.pose_maker.empty())
    throw IOException(folder + ": the poses of the recording (" + recording.format +
                      ") are measured truth, which is no prior; give a file of poses");
  return recording.ground_truth;
}

/** "0.1 ... 2.5 s". */
std::string
timesOf(double first, double last)
{
  return shortText(first, 12) + " ... " + shortText(last, 12) + " s";
}

[[noreturn]] void
refuseOtherTimes(const std::string& source, const Trajectory& poses, double max_difference,
                 const Recording& recording)
{
  const auto [first, last] = std::minmax_element(
      recording.frames.begin(), recording.frames.end(),
      [](const RecordedFrame& a, const RecordedFrame& b) { return a.timestamp < b.timestamp; });
  throw IOException(source + ": no pose is within " + shortText(max_difference, 3) +
                    " s of a frame; the times of the poses are " +
                    timesOf(poses.front().timestamp, poses.back().timestamp) +
                    ", those of the frames " + timesOf(first->timestamp, last->timestamp));
}

void
sayDevicePoses(bool are_prior, Recording& recording)
{
  if (recording.pose_maker.empty() || recording.ground_truth.empty())
    return;
  recording.findings.push_back({Severity::NOTE,
                                "poses",
                                "the poses of the recording are those that " +
                                    recording.pose_maker +
                                    " estimated, not measured truth; they are " +
                                    (are_prior ? "the prior" : "not used as a prior"),
                                {{"poses", double(recording.ground_truth.size())}},
                                ""});
}

} // namespace

void
takePriors(const DatasetOptions& options, const std::string& folder, Recording& recording)
{
  sayDevicePoses(options.pose_prior && !options.pose_prior->trajectory, recording);
  if (!options.pose_prior || recording.frames.empty())
    return;
  const PosePriorOptions& prior = *options.pose_prior;
  const Trajectory& poses = prior.trajectory ? *prior.trajectory : devicePoses(folder, recording);
  std::size_t count = 0;
  for (RecordedFrame& frame : recording.frames)
    if (const auto pose = poseAt(poses, frame.timestamp, options.max_time_difference)) {
      frame.prior = PosePrior{*pose, prior.position_sigma, prior.rotation_sigma};
      ++count;
    }
  if (count == 0)
    refuseOtherTimes(prior.trajectory ? prior.source : folder, poses, options.max_time_difference,
                     recording);
}

} // namespace bundle_icp
