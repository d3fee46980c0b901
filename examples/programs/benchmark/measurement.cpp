// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "measurement.h"

#include <cmath>

namespace bundle_icp {
namespace {

std::string
ordinal(std::size_t n)
{
  const bool teen = n % 100 >= 11 && n % 100 <= 13;
  const char* const endings[] = {"th", "st", "nd", "rd"};
  return std::to_string(n) + (teen || n % 10 > 3 ? "th" : endings[n % 10]);
}

} // namespace

std::string
toString(const Condition& condition)
{
  std::string text =
      condition.keep == 1 ? "every frame" : "every " + ordinal(condition.keep) + " frame";
  if (condition.blur > 0)
    text += ", " + std::to_string(std::lround(100 * condition.blur)) + " % blurred";
  return text;
}

Measurement
measure(PreparedScan& scan, const Variant& variant, const ReconstructionOptions& options,
        const Trajectory& truth, const ProgressCallback& progress)
{
  ReconstructionOptions varied = options;
  variant.apply(varied);
  const ReconstructionResult result = reconstruct(scan, varied, progress);
  const Trajectory trajectory = result.trajectory();
  Measurement m;
  m.variant = variant.name;
  m.frames = result.frames.size();
  m.registered = trajectory.size();
  m.absolute = absoluteTrajectoryError(truth, trajectory);
  const auto relative = [&](RelativePoseInterval interval) {
    return relativePoseError(truth, trajectory, interval);
  };
  m.frame = relative(RelativePoseInterval::FRAME);
  m.second = relative(RelativePoseInterval::SECOND);
  m.all_pairs = relative(RelativePoseInterval::ALL_PAIRS);
  for (const auto& [stage, seconds] : result.timing_s)
    m.seconds += seconds;
  return m;
}

} // namespace bundle_icp
