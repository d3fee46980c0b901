// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/evaluation/error_statistics.h>
#include <bundle_icp/io/trajectory.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace bundle_icp {

/** Absolute trajectory error after rigid alignment without scale (Sturm et al., IROS 2012). */
struct AbsoluteTrajectoryError {
  ErrorStatistics translation;                 ///< [m]
  Pose truth_from_estimate = Pose::Identity(); ///< the alignment (Horn 1987)
};

/** Relative pose error over a set of pairs (Sturm et al., IROS 2012). */
struct RelativePoseError {
  ErrorStatistics translation; ///< [m]
  ErrorStatistics rotation;    ///< [rad]
};

/** Pairs of estimated poses for a relative pose error. */
enum class RelativePoseInterval {
  FRAME,    ///< each pose and the next
  SECOND,   ///< each pose and the pose closest to 1 s later
  ALL_PAIRS ///< below 100 poses all pairs, otherwise 10,000 pairs, drawn as by Python's
            ///< random.seed(0)
};

/** ATE exactly as the TUM benchmark's evaluate_ate.py defines it. Poses are associated one to one
 *  by time, closest first. Positions are aligned by the rigid motion that minimises sum
 *  |truth_from_estimate * estimate_i - truth_i|^2. Unset with fewer than 3 pairs.
 *  \param max_difference largest time between associated poses [s]. */
BUNDLE_ICP_EXPORT std::optional<AbsoluteTrajectoryError>
absoluteTrajectoryError(const Trajectory& truth, const Trajectory& estimate,
                        double max_difference = 0.02);

/** RPE exactly as the TUM benchmark's evaluate_rpe.py defines it. The error of a pair (i, j) of
 *  estimated poses P with true poses Q is (P_j^-1 P_i)^-1 (Q_j^-1 Q_i). The true pose is the
 *  closest in time. A pair is left out where the true pose is farther away than twice the median
 *  interval of the truth, and, for FRAME and SECOND, where j is the last pose. Unset with fewer
 *  than 2 pairs. */
BUNDLE_ICP_EXPORT std::optional<RelativePoseError>
relativePoseError(const Trajectory& truth, const Trajectory& estimate,
                  RelativePoseInterval interval);

/** Number of frames taken at `timestamps` [s] for which the estimate has a pose within
 *  `max_difference` [s]. Each frame counts once, and one pose serves one frame. */
BUNDLE_ICP_EXPORT std::size_t
countFramesWithPose(const std::vector<double>& timestamps, const Trajectory& estimate,
                    double max_difference = 0.02);

} // namespace bundle_icp
