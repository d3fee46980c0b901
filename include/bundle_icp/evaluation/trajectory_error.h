// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/trajectory.h>

#include <cstddef>
#include <optional>

namespace bundle_icp {

/** RMSE, mean, median and maximum of a set of errors. */
struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
  std::size_t count = 0;
};

/** Absolute trajectory error [m] after rigid alignment without scale (Sturm et al., IROS 2012). */
struct AbsoluteTrajectoryError {
  ErrorStatistics translation;                 ///< [m]
  Pose truth_from_estimate = Pose::Identity(); ///< the alignment (Horn 1987)
};

/** Relative pose error over a set of pairs (Sturm et al., IROS 2012). */
struct RelativePoseError {
  ErrorStatistics translation; ///< [m]
  ErrorStatistics rotation;    ///< [rad]
};

/** Which pairs of estimated poses a relative pose error is taken over. */
enum class RelativePoseInterval {
  FRAME,    ///< each pose and the next
  SECOND,   ///< each pose and the one closest to 1 s later
  ALL_PAIRS ///< 10,000 random pairs with Python's random.seed(0) replaced by a fixed generator; all pairs below 100 poses
};

/** ATE exactly as the TUM benchmark's evaluate_ate.py defines it; unset with fewer than 3 pairs.
 *  \param max_difference largest time between associated poses [s]. */
BUNDLE_ICP_EXPORT std::optional<AbsoluteTrajectoryError>
absoluteTrajectoryError(const Trajectory& truth,
                        const Trajectory& estimate,
                        double max_difference = 0.02);

/** RPE exactly as the TUM benchmark's evaluate_rpe.py defines it; unset with fewer than 2 pairs. */
BUNDLE_ICP_EXPORT std::optional<RelativePoseError>
relativePoseError(const Trajectory& truth,
                  const Trajectory& estimate,
                  RelativePoseInterval interval);

} // namespace bundle_icp
