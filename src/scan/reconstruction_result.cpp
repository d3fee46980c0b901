// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/reconstruction.h>

#include <algorithm>

namespace bundle_icp {

const char*
toString(ReconstructionStatus status)
{
  switch (status) {
  case ReconstructionStatus::COMPLETED:
    return "COMPLETED";
  case ReconstructionStatus::STOPPED:
    return "STOPPED";
  case ReconstructionStatus::NOTHING_REGISTERED:
    return "NOTHING_REGISTERED";
  case ReconstructionStatus::NO_OBJECT:
    return "NO_OBJECT";
  }
  return "";
}

Verdict
ReconstructionResult::verdict() const
{
  return verdictOf(findings);
}

std::string
ReconstructionResult::summary() const
{
  const std::size_t largest = component_sizes.empty() ? 0 : component_sizes.front();
  std::string text = std::to_string(largest) + " of " + std::to_string(frames.size()) +
                     " frames have a pose in one world";
  for (std::size_t c = 1; c < component_sizes.size(); ++c)
    text += (c == 1 ? "; not connected to it: " : ", ") + std::to_string(component_sizes[c]);
  const auto doubtful = std::count_if(frames.begin(), frames.end(), [](const FrameReport& frame) {
    return frame.verdict == FrameVerdict::DOUBTFUL;
  });
  if (doubtful > 0)
    text += "; doubtful: " + std::to_string(doubtful);
  return text;
}

} // namespace bundle_icp
