// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "variants.h"

#include <bundle_icp/evaluation/trajectory_error.h>

#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Result of one variant. Poses are those of the largest component. */
struct Measurement {
  std::string variant;
  std::size_t frames = 0, registered = 0;
  std::optional<AbsoluteTrajectoryError> absolute; ///< unset with too few poses
  std::optional<RelativePoseError> frame, second, all_pairs;
  double seconds = 0; ///< wall time to the poses, shared stages included

  double
  share() const
  {
    return double(registered) / double(frames);
  }
};

/** Change that is made to a recording. */
struct Condition {
  std::size_t keep = 1; ///< every n-th frame
  double blur = 0;      ///< share of blurred colour images
};

/** "every frame", "every 5th frame, 20 % blurred" */
std::string
toString(const Condition& condition);

/** All variants under one condition. */
struct ConditionResult {
  Condition condition;
  std::vector<Measurement> measurements;
};

/** All conditions of one recording. */
struct ScanResult {
  std::string name; ///< of its folder
  std::vector<ConditionResult> conditions;
  std::string warning; ///< why its poses are no measured truth; empty = they are
};

Measurement
measure(PreparedScan& scan, const Variant& variant, const ReconstructionOptions& options,
        const Trajectory& truth, const ProgressCallback& progress);

} // namespace bundle_icp
