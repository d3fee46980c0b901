// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>
#include <bundle_icp/common/pose_estimate.h>
#include <bundle_icp/graph/features.h>

#include <vector>

namespace bundle_icp {

/** A feature of a frame and the point of the model that the feature shows. */
struct PointObservation {
  int feature = 0;
  Eigen::Vector3d point; ///< [m], world frame
};

/** Dense evidence on the pose: the quadratic form of increment(delta) * world_from_camera around
 *  its own optimum. */
struct DensePoseTerm {
  Pose world_from_camera = Pose::Identity();
  Matrix6d information = Matrix6d::Zero();
};

/** Information of a pose without evidence, on motions about the world's origin [1 / rad^2, 1 /
 *  m^2]: keeps covariances finite where not everything is seen. */
constexpr double PRIOR_INFORMATION = 1;

/** Largest standard deviation in any direction, from a 3x3 block of a covariance. */
double
largestDeviation(const Eigen::Matrix3d& covariance);

/** How a motion of a PoseBlock turns [rad] and moves [m] the camera along the axes of the world. */
Matrix6d
worldByMotion(const Pose& world_from_camera);

/** The pose of one frame given the points that it sees: the same residuals and loss as
 *  adjustBundle(), with points and calibration held. Isotropic 3D-3D distances, as
 *  in Algorithm 1, line 2, give away that pixels are known far better than depth.
 *  \param depth_error whether the DepthError moves, too */
PoseEstimate
adjustPose(const ImageGraph& graph, const SparseModel& model, std::size_t frame,
           const std::vector<PointObservation>& observations, const DensePoseTerm& dense,
           const BundleAdjustmentOptions& options, bool depth_error, const PoseEstimate& start);

} // namespace bundle_icp
