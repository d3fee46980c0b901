// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/source_points.h"
#include "registration/target_grid.h"

namespace bundle_icp {

/** One linearised distance per entry: residual r of a point p (relative to a centre)
 * along a unit direction n, over sigma. Entries without a match have inverse_sigma 0.
 */
struct Matches {
  /** Sizes are multiples of it, so that sums take whole blocks. */
  static constexpr std::size_t LANES = 16;

  std::vector<float> px, py, pz, nx, ny, nz, residual, inverse_sigma;
  std::vector<float> sx, sy, sz; ///< the source's own normal; n where it has none
  std::vector<int> target;       ///< matched target point, -1 = none

  void
  resize(std::size_t size);

  std::size_t
  size() const
  {
    return target.size();
  }
};

/** How generous a level of detail is. */
struct MatchTolerance {
  float max_distance = 0; ///< of a match [m]
  /** Distance [m] that a coarse pose may leave. It widens sigma: otherwise the structures that hold
   *  the pose would count as outliers of walls that are already aligned. */
  float misalignment = 0;
};

/** Associates by projection into the target's grid and fills matches. */
void
matchByProjection(const AlignmentProblem& problem, const TargetGrid& target,
                  const SourcePoints& source, const Pose& pose, const Eigen::Vector3d& center,
                  const MatchTolerance& tolerance, Matches& matches);

/** How well the clouds meet at a pose. */
struct Meeting {
  double near = 0;    ///< source points on the target
  double against = 0; ///< weight of source points that contradict the pose
};

/** By projection: near is within three (scaled) sigma of the visible surface. Other points where
 *  the target's camera measured are against the pose. A point behind the surface may be hidden; a
 *  point in front of it, where the camera saw through, counts twice. */
Meeting
meetingByProjection(const TargetGrid& target, const SourcePoints& source, const Pose& pose,
                    const Matches& matches, double scale);

/** Ratio of observed to expected standard deviation: 1.4826 times the median of |r| /
 * sigma. */
double
robustScale(const Matches& matches);

/** Root mean square of |r| / sigma. */
double
rmsError(const Matches& matches);

} // namespace bundle_icp
