// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "registration/target_grid.h"

#include <vector>

namespace bundle_icp {

/** Source points of one level of detail, as arrays of one coordinate each. */
struct SourcePoints {
  std::vector<float> x, y, z;
  std::vector<float> nx, ny, nz; ///< empty without normals
  std::vector<int> index;        ///< in the source cloud
  int stride = 1;                ///< every stride-th pixel of the cloud, both ways
  double patch = 1;              ///< number of these points that share the noise of one measurement

  std::size_t
  size() const
  {
    return index.size();
  }
};

/** One linearised distance per entry: residual r of a point p (relative to a centre)
 * along a unit direction n, over sigma. Entries without a match have inverse_sigma 0.
 */
struct Matches {
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

/** Sums over matches: normal equations H delta = -g about the centre. */
struct DenseSystem {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  /** H with one normal of each product from the source. The noise of the two normals is independent
   *  and cancels, whereas in H it looks like structure that holds the pose. */
  Matrix6d structure = Matrix6d::Zero();
  double weight = 0;          ///< sum of weights / sigma^2
  double squared_error = 0;   ///< weighted sum of squared residuals [m^2]
  double weight_metric = 0;   ///< sum of the weights
  std::size_t matched = 0;    ///< entries with a match
  std::size_t inliers = 0;    ///< entries within three (scaled) sigma
  double squared_inliers = 0; ///< sum of squared residuals of these entries [m^2]
};

/** Every source point of the level: all that are finite, `stride`-th of the grid or
 * list. */
SourcePoints
selectSource(const AlignmentProblem& problem, int stride);

/** Tolerances of a level of detail. */
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

/** Standard deviations beyond which Tukey's biweight is 0: 95 % efficient on normal errors. */
constexpr double TUKEY_CUTOFF = 4.685;

/** Tukey's biweight of a normalised residual. */
constexpr double
robustWeight(double error)
{
  const double inside = 1 - error * error / (TUKEY_CUTOFF * TUKEY_CUTOFF);
  return inside > 0 ? inside * inside : 0;
}

/** Sums the normal equations with Tukey's biweight at `scale`. */
DenseSystem
accumulate(const Matches& matches, double scale, int num_threads);

} // namespace bundle_icp
