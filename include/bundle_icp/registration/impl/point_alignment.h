// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/registration/bundle_icp_result.h>
#include <bundle_icp/registration/visual_pose.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

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
  view.width = int(cloud.width);
  view.height = int(cloud.height);
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
   *  RigidAlignment::scale of their robust fit. */
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

/** Algorithm 1 of the paper, lines 4 to 7: ICP that starts from the pose T*_new of line 2. The
 *  result does not depend on the number of threads. */
BUNDLE_ICP_EXPORT BundleICPResult
alignPoints(const AlignmentProblem& problem, const Pose& start);

} // namespace bundle_icp
