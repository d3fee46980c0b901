// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Correspondences M_reg,new between a new frame and the registered ones (Algorithm 1,
 * line 1): three lists of equal length. */
struct VisualCorrespondences {
  std::vector<Eigen::Vector3d> source; ///< in the new frame's camera [m]
  std::vector<Eigen::Vector3d> target; ///< in the world [m]
  std::vector<double> weights;         ///< 1 / sigma^2 of the distance [1/m^2], > 0
};

/** How estimateVisualPose() works. */
struct BUNDLE_ICP_EXPORT VisualPoseOptions {
  /** A correspondence supports a pose when it fits within this many of its own sigma;
   * wide, as the weights rarely know of every error. */
  double inlier_sigmas = 4;
  /** Fewer supporting correspondences than this are no evidence of a pose. */
  std::size_t min_inliers = 6;
  /** Samples of three that RANSAC draws at most; it stops early once it is 99.9 % sure.
   */
  int max_samples = 2000;
  /** Seed of the samples. */
  std::uint64_t seed = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** A pose and what supports it. */
struct VisualPose {
  Pose world_from_source = Pose::Identity();
  std::size_t inliers = 0; ///< correspondences within inlier_sigmas
  double rmse = 0;         ///< distance of the inliers [m]
  /** Observed over expected standard deviation of the inliers, at least 1: by this
   * factor the weights are too optimistic. */
  double scale = 1;
};

/** The initial pose T*_new of Algorithm 1, line 2: robust least squares over the
 * distances of all correspondences, by RANSAC over 3-point samples and reweighted least
 * squares. Unset when there are fewer than min_inliers, or no consensus. \throws
 * pcl::BadArgumentException when the lists differ in length, a value is not finite or
 *  a weight is not positive. */
BUNDLE_ICP_EXPORT std::optional<VisualPose>
estimateVisualPose(const VisualCorrespondences& correspondences,
                   const VisualPoseOptions& options = {});

/** Checks the lists; the error names the first fault. */
BUNDLE_ICP_EXPORT bool
isValid(const VisualCorrespondences& correspondences, std::string* error = nullptr);

} // namespace bundle_icp
