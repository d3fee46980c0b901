// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/registration/visual_pose.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <functional>
#include <limits>
#include <optional>
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
  REFINEMENT_REJECTED,     ///< ICP contradicts the visual evidence, which gives the pose
  INVALID_INPUT            ///< nothing was computed; the reason was printed
};

/** Name of a status, as it is written here. */
BUNDLE_ICP_EXPORT const char*
toString(BundleICPStatus status);

/** Whether the clouds meet at the final pose. */
constexpr bool
hasConverged(BundleICPStatus status)
{
  return status == BundleICPStatus::CONVERGED || status == BundleICPStatus::MAX_ITERATIONS;
}

/** Result of align() beside the pose. */
struct BUNDLE_ICP_EXPORT BundleICPResult {
  BundleICPStatus status = BundleICPStatus::NOT_RUN;
  bool projective = false;          ///< points were associated by projection, not by kd-tree
  bool visual_initial_pose = false; ///< the start was the visual pose, not the guess
  std::size_t inliers = 0;          ///< used source points that lie near points of the target
  double overlap = 0;               ///< inliers over used source points, 0 to 1
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

  /** One line: status, overlap, distance, iterations. */
  std::string
  summary() const;
};

/** Points of a cloud of any type: entry i lies at xyz + i * stride. */
struct PointsView {
  const float* xyz = nullptr;
  const float* normals = nullptr; ///< nullptr: none
  std::size_t stride = 0;         ///< floats from one point to the next
  std::size_t size = 0;
  int width = 0, height = 0; ///< size of an organized cloud; height 1 otherwise
};

/** A PointsView of the points of a cloud. The cloud must outlive it. */
template <typename PointT>
PointsView
viewPoints(const pcl::PointCloud<PointT>& cloud)
{
  static_assert(sizeof(PointT) % sizeof(float) == 0, "points must be padded to whole floats");
  PointsView view;
  view.xyz = &cloud.front().x;
  view.stride = sizeof(PointT) / sizeof(float);
  view.size = cloud.size();
  view.width = static_cast<int>(cloud.width);
  view.height = static_cast<int>(cloud.height);
  if constexpr (pcl::traits::has_normal<PointT>::value)
    view.normals = &cloud.front().normal_x;
  return view;
}

/** Input of alignPoints(): the part of BundleICP that does not depend on the point type. */
struct AlignmentProblem {
  PointsView source, target;
  const std::vector<int>* source_indices = nullptr; ///< source points to use, nullptr: all
  std::optional<CameraIntrinsics> camera;
  Pose world_from_virtual = Pose::Identity();
  /** Visual correspondences that gave the start pose (Algorithm 1, line 1), may be empty, and
   *  VisualPose::scale of their robust fit. */
  VisualCorrespondences visual;
  double visual_scale = 1;

  /** Largest distance between the surfaces under the guess [m]. Projective association has coarse
   *  levels for 0.03, 0.1 and 0.3 m and uses those within this distance. */
  double max_misalignment = 0.3;
  /** Share of the noise model in the covariance, 0 to 1; the rest comes from the residuals, whose
   *  scatter a few dozen tiles of an image show only roughly. */
  double model_share = 0.15;
  int max_iterations = 100;
  double max_distance = std::numeric_limits<double>::max(); ///< longest correspondence [m]
  double translation_epsilon = 1e-8;  ///< squared length of a step that ends the loop [m^2]
  double rotation_epsilon = 1 - 1e-8; ///< cosine of a step's angle that ends the loop
  double fitness_epsilon = -1;        ///< relative change of the mean squared distance
  int num_threads = 0;

  /** Finds up to k target points nearest to a position, nearest first; none = empty list. Several
   *  threads call it. */
  std::function<void(const float* xyz, int k, std::vector<int>& indices)> nearest;
  /** Renders the target as seen from a pose; gives nothing if that fails. May be empty. */
  std::function<std::optional<PointsView>(const Pose& world_from_virtual)> render;
  /** Called after each iteration with the pose and the pairs of points used. May be
   * empty. */
  std::function<void(const Pose&, const std::vector<int>& source, const std::vector<int>& target)>
      on_iteration;
};

/** Result of alignPoints(). */
struct Alignment {
  Pose world_from_source = Pose::Identity();
  Pose last_step = Pose::Identity(); ///< motion of the last iteration
  BundleICPResult result;
};

/** Algorithm 1 of the paper, lines 4 to 7: ICP that starts from the pose T*_new of line 2. The
 *  result does not depend on the number of threads. */
BUNDLE_ICP_EXPORT Alignment
alignPoints(const AlignmentProblem& problem, const Pose& start);

} // namespace bundle_icp
