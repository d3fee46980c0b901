// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <cstdint>
#include <string>
#include <vector>

namespace bundle_icp {

/** A pair of points that should coincide. */
struct PointPair {
  Eigen::Vector3d source; ///< [m], source frame
  Eigen::Vector3d target; ///< [m], target frame
  double variance = 1;    ///< of one coordinate of the difference [m^2]
};

/** How robustRigidAlignment() looks for the motion. */
struct BUNDLE_ICP_EXPORT RigidAlignmentOptions {
  /** Pairs whose distance is below this many standard deviations are inliers. */
  double inlier_sigmas = 3.5;
  /** At most so many random samples of three pairs. */
  int max_iterations = 500;
  /** Samples are drawn until an all-inlier one was among them with this probability. */
  double confidence = 0.9999;
  /** Iteratively reweighted least squares steps after the best sample. */
  int refinements = 5;
  std::uint64_t seed = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Result of robustRigidAlignment(). */
struct RigidAlignment {
  bool success = false;                      ///< at least three inliers not on one line
  Pose target_from_source = Pose::Identity();
  std::vector<std::size_t> inliers;          ///< ascending indices of pairs
  double rmse = 0;                           ///< of the inliers, in standard deviations per coordinate
};

/** The motion that minimises the weighted sum of squared distances (Horn 1987; Umeyama 1991
 *  without scale). Weights are 1 / variance times `factors` when given. */
BUNDLE_ICP_EXPORT Pose
rigidAlignment(const std::vector<PointPair>& pairs, const std::vector<double>& factors = {});

/** The motion that most pairs agree on: RANSAC over samples of three, scored by a truncated
 *  quadratic cost (MSAC), then reweighted least squares over the inliers. The result depends
 *  on nothing but the arguments. */
BUNDLE_ICP_EXPORT RigidAlignment
robustRigidAlignment(const std::vector<PointPair>& pairs,
                     const RigidAlignmentOptions& options = {});

} // namespace bundle_icp
