// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/rigid_alignment.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Correspondences M_reg,new between a new frame and the registered frames (Algorithm 1, line 1):
 *  three lists of equal length. */
struct VisualCorrespondences {
  std::vector<Eigen::Vector3d> source; ///< points in the new frame's camera frame [m]
  std::vector<Eigen::Vector3d> target; ///< points in the world frame [m]
  std::vector<double> weights;         ///< 1 / sigma^2 of the distance [1/m^2], > 0
};

/** How estimateVisualPose() works. */
struct BUNDLE_ICP_EXPORT VisualPoseOptions {
  /** Its inliers support the pose. The bound is wide: weights rarely cover every error. */
  RigidAlignmentOptions alignment{4, 2000, 0.999, 0};
  /** Minimum number of inliers that support a pose. */
  std::size_t min_inliers = 6;

  bool
  isValid(std::string* error = nullptr) const;
};

/** The initial pose T*_new (world_from_source) of Algorithm 1, line 2: robust least squares over
 *  the distances of all correspondences, see robustRigidAlignment(). Unset when there are fewer
 *  than min_inliers or no consensus. \throws pcl::BadArgumentException when the lists differ in
 *  length, a value is not finite or a weight is not positive. */
BUNDLE_ICP_EXPORT std::optional<RigidAlignment>
estimateVisualPose(const VisualCorrespondences& correspondences,
                   const VisualPoseOptions& options = {});

/** Checks the lists; `error` names the first fault. */
BUNDLE_ICP_EXPORT bool
isValid(const VisualCorrespondences& correspondences, std::string* error = nullptr);

} // namespace bundle_icp
