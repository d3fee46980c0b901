// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** A pair of points that should coincide. */
struct PointPair {
  Eigen::Vector3d source; ///< [m], source frame
  Eigen::Vector3d target; ///< [m], target frame
  double weight = 1;      ///< 1 / variance of one coordinate of the difference [1/m^2], > 0
};

/** Options of robustRigidAlignment(). */
struct BUNDLE_ICP_EXPORT RigidAlignmentOptions {
  /** Pairs whose distance is at most this many standard deviations of the pair are inliers. */
  double inlier_sigmas = 3.5;
  /** Maximum number of random samples of three pairs. */
  int max_samples = 500;
  /** Sampling stops when at least one sample had only inliers with this probability. */
  double confidence = 0.999;
  std::uint64_t seed = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Result of robustRigidAlignment(). */
struct RigidAlignment {
  bool success = false; ///< at least three inliers, whose distance from a line exceeds their errors
  Pose target_from_source = Pose::Identity();
  std::vector<std::size_t> inliers; ///< ascending indices of pairs
  double rmse = 0;                  ///< RMS distance of the inliers [m]
  /** Observed over expected standard deviation of the inliers, at least 1: the weights are too
   *  optimistic by this factor. */
  double scale = 1;
};

/** The motion that minimises the weighted sum of squared distances (Horn 1987; Umeyama 1991 without
 *  scale); unset when the points lie on a line.
 *  \param weights replace the weights of the pairs, when given */
BUNDLE_ICP_EXPORT std::optional<Pose>
rigidAlignment(const std::vector<PointPair>& pairs, const std::vector<double>& weights = {});

/** The motion that most pairs support: RANSAC over samples of three, scored by a truncated
 *  quadratic cost (MSAC), then least squares with Tukey's biweight. The result depends only on the
 *  arguments.
 *  \throws pcl::BadArgumentException for invalid options. */
BUNDLE_ICP_EXPORT RigidAlignment
robustRigidAlignment(const std::vector<PointPair>& pairs,
                     const RigidAlignmentOptions& options = {});

} // namespace bundle_icp
