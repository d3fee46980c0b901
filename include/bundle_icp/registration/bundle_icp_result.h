// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <cstddef>
#include <string>
#include <vector>

namespace bundle_icp {

/** Outcome of BundleICP::align(). */
enum class BundleICPStatus {
  NOT_RUN,                 ///< align() has not run since the inputs were set
  CONVERGED,               ///< the last step was smaller than the epsilons
  MAX_ITERATIONS,          ///< the limit stopped the loop; the pose is that of the last iteration
  TOO_FEW_CORRESPONDENCES, ///< source and target do not meet; the pose is the initial pose
  NO_OVERLAP,              ///< the clouds do not meet at the last pose, or contradict each other
  /** The clouds meet at the last pose, but it cannot be trusted: in less than a quarter of the
   *  source, or at another pose nearly as well, or they leave directions of motion open. Not with
   *  visual correspondences, nor with a guess that is said to be right within 3 cm
   *  (BundleICP::setMaxMisalignment()), which decide then. */
  LOW_OVERLAP,
  REFINEMENT_REJECTED, ///< ICP contradicts the visual evidence, which gives the pose
  INVALID_INPUT        ///< nothing was computed; the reason was printed
};

/** Name of a status, as it is written here. */
BUNDLE_ICP_EXPORT const char*
toString(BundleICPStatus status);

/** Whether the clouds meet at the final pose, and there alone. */
constexpr bool
hasConverged(BundleICPStatus status)
{
  return status == BundleICPStatus::CONVERGED || status == BundleICPStatus::MAX_ITERATIONS;
}

/** Result of align(). */
struct BUNDLE_ICP_EXPORT BundleICPResult {
  BundleICPStatus status = BundleICPStatus::NOT_RUN;
  Pose world_from_source = Pose::Identity();
  Pose last_step = Pose::Identity(); ///< motion of the last iteration
  bool projective = false;           ///< points were associated by projection, not by kd-tree
  bool visual_initial_pose = false;  ///< the start was the visual pose, not the guess
  std::size_t inliers = 0;           ///< used source points that lie near points of the target
  double overlap = 0;                ///< inliers over used source points, 0 to 1
  /** Share of the informative source points that support the pose, 0 to 1. Not informative: points
   *  that the target's camera could not see; without a camera, points far from the target. */
  double agreement = 0;
  double rmse = 0;                ///< RMS distance of the inliers to the target's surface [m]
  std::size_t visual_inliers = 0; ///< visual correspondences that agree with the pose
  double visual_rmse = 0;         ///< RMS distance of these visual inliers [m]
  int iterations = 0;
  int renderings = 0; ///< number of times that the virtual depth was rendered again
  /** Dense evidence alone: the most likely pose is `dense_pose`; `information` is that of motions
   *  increment(delta) of `dense_pose`. Without visual correspondences `dense_pose` is the final
   *  pose. With them, the sum of dense and visual evidence counts each once. The noise of
   *  neighbouring pixels is correlated: a patch of 9 x 9 pixels at a focal length of 525 px (the
   *  window of structured light) counts as one measurement. */
  Matrix6d information = Matrix6d::Zero();
  Pose dense_pose = Pose::Identity();
  /** Unit motions delta (as above) that the surfaces do not constrain, for example sliding along a
   *  plane. Along these motions ICP adds nothing to what the visual correspondences say. */
  std::vector<Vector6d> degenerate_directions;

  /** Covariance of `dense_pose` [rad, m]: the inverse of `information`, infinite where the
   *  degenerate directions move a coordinate by a hundredth of their length or more (there, the
   *  limit of an information that falls to 0). Infinite throughout when nothing was measured. */
  Matrix6d
  covariance() const;

  /** One line: status, overlap, distance, iterations. */
  std::string
  summary() const;
};

} // namespace bundle_icp
