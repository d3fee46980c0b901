// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

namespace bundle_icp {

/** Whether the pose of a frame can be trusted. */
enum class FrameVerdict {
  LEFT_OUT, ///< it has no pose; FrameRegistration::reason says why
  GOOD,     ///< matches and depth of other frames agree with its pose
  DOUBTFUL, ///< they contradict its pose, or nothing speaks for it
  UNCHECKED ///< it was tracked or given, or the run was stopped: nothing verified its pose
};

/** Name of a verdict: "left out", "good", "doubtful", "unchecked". */
inline const char*
toString(FrameVerdict verdict)
{
  return verdict == FrameVerdict::LEFT_OUT   ? "left out"
         : verdict == FrameVerdict::GOOD     ? "good"
         : verdict == FrameVerdict::DOUBTFUL ? "doubtful"
                                             : "unchecked";
}

} // namespace bundle_icp
