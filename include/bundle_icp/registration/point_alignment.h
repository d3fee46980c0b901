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
  NOT_RUN,                 ///< no align() since the inputs were set
  CONVERGED,               ///< the last step was smaller than the epsilons
  MAX_ITERATIONS,          ///< stopped by the limit; the pose is that of the last iteration
  TOO_FEW_CORRESPONDENCES, ///< source and target do not meet; the pose is the initial
                           ///< one
  NO_OVERLAP,          ///< the clouds do not meet where the loop ended, or contradict each other
  REFINEMENT_REJECTED, ///< ICP contradicts the visual evidence; the pose is that of the
                       ///< latter
  INVALID_INPUT        ///< nothing was computed; the reason was printed
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

/** What align() found, beside the pose. */
struct BUNDLE_ICP_EXPORT BundleICPResult {
  BundleICPStatus status = BundleICPStatus::NOT_RUN;
  bool projective = false;          ///< associated by projection, not by kd-tree
  bool visual_initial_pose = false; ///< started from the visual correspondences, not the guess
  std::size_t inliers = 0;          ///< source points near points of the target, of those used
  double overlap = 0;               ///< inliers over source points used, 0 to 1
  /** Share of the source points that speak for the pose, 0 to 1, of those that say anything of it:
   * not outside of what the target's camera saw nor, without a camera, far from the target. */
  double agreement = 0;
  double rmse = 0;                ///< distance of the inliers to the target's surface [m]
  std::size_t visual_inliers = 0; ///< visual correspondences that agree with the pose
  double visual_rmse = 0;         ///< distance of these [m]
  int iterations = 0;
  int renderings = 0; ///< how often the virtual depth was rendered anew
  /** What dense evidence alone says of the pose: it is likeliest at `dense_pose`, with
   * this information on motions increment(delta) of it. Without visual correspondences
   * that is the final pose; with them, counting both is counting each once. The noise of
   * neighbouring pixels is correlated: a patch of 9 x 9 pixels at a focal length of 525
   * px (as the windows of structured light) counts as one measurement. */
  Matrix6d information = Matrix6d::Zero();
  Pose dense_pose = Pose::Identity();
  /** Unit motions delta (as above) that the surfaces leave open, as sliding along a
   * plane; ICP did not change the pose along them beyond what visual correspondences
   * say. */
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
  int width = 0, height = 0; ///< of an organized cloud; height 1 otherwise
};

/** The points of a cloud, which must outlive the view. */
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

/** What does not depend on the point type of BundleICP: all that alignPoints() needs.
 */
struct AlignmentProblem {
  PointsView source, target;
  const std::vector<int>* source_indices = nullptr; ///< part of the source to use, nullptr: all
  std::optional<CameraIntrinsics> camera;
  Pose world_from_virtual = Pose::Identity();
  /** Evidence that the start comes from (Algorithm 1, line 1), unless empty, and VisualPose::scale
   * of its robust fit. */
  VisualCorrespondences visual;
  double visual_scale = 1;

  /** How far the surfaces may lie apart under the guess [m]: the coarse levels of projective
   * association allow for 0.03, 0.1 and 0.3 m, as far as that is within it. */
  double max_misalignment = 0.3;
  /** Share of the noise model in the covariance, 0 to 1; the rest is what residuals show. A few
   * dozen tiles of an image tell only roughly how they scatter. */
  double model_share = 0.15;
  int max_iterations = 100;
  double max_distance = std::numeric_limits<double>::max(); ///< of a correspondence [m]
  double translation_epsilon = 1e-8;  ///< squared length of a step that ends the loop [m^2]
  double rotation_epsilon = 1 - 1e-8; ///< cosine of a step's angle that ends the loop
  double fitness_epsilon = -1;        ///< relative change of the mean squared distance
  int num_threads = 0;

  /** Up to k nearest target points of a position, nearest first; empty for none. Called
   * by several threads. */
  std::function<void(const float* xyz, int k, std::vector<int>& indices)> nearest;
  /** Renders the target as seen from a pose; nothing when it cannot. May be empty. */
  std::function<std::optional<PointsView>(const Pose& world_from_virtual)> render;
  /** Called after each iteration with the pose and the pairs of points used. May be
   * empty. */
  std::function<void(const Pose&, const std::vector<int>& source, const std::vector<int>& target)>
      on_iteration;
};

/** Pose, and what belongs to it. */
struct Alignment {
  Pose world_from_source = Pose::Identity();
  Pose last_step = Pose::Identity(); ///< motion of the last iteration
  BundleICPResult result;
};

/** Algorithm 1 of the paper, lines 4 to 7: ICP from the pose T*_new that line 2 gives. The result
 * does not depend on the number of threads. */
BUNDLE_ICP_EXPORT Alignment
alignPoints(const AlignmentProblem& problem, const Pose& start);

} // namespace bundle_icp
