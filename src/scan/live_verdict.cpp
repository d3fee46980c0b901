// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_verdict.h"

#include "adjustment/pose_adjustment.h"

#include <Eigen/Cholesky>

#include <cmath>

namespace bundle_icp {
namespace {

/** Support that a good pose has at least: share of the depth on the model, and of the depth that
 *  can tell. With features, and without. */
constexpr double MIN_OVERLAP = 0.4, MIN_AGREEMENT = 0.85;
constexpr double MIN_OVERLAP_SEEN = 0.2, MIN_AGREEMENT_SEEN = 0.6;
/** A pose with less is none. */
constexpr double LOST_OVERLAP = 0.25, LOST_AGREEMENT = 0.6;

/** Further from where it was [m], or turned by more [rad], a pose is not what led to it. */
constexpr double LARGEST_CORRECTION = 0.05, LARGEST_TURN = 0.05;

/** Covariance of the camera's rotation and position along the axes of the world, from information
 *  on motions on the left of its pose. */
Matrix6d
poseCovariance(Matrix6d information, const Pose& world_from_camera)
{
  information.diagonal().array() += PRIOR_INFORMATION;
  Matrix6d camera_by_motion = Matrix6d::Identity();
  camera_by_motion.bottomLeftCorner<3, 3>() = -crossMatrix(world_from_camera.translation());
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  return camera_by_motion * inverse * camera_by_motion.transpose();
}

/** What matches that agree with a pose tell of it. */
Matrix6d
visualInformation(const VisualMatches& matched, const Pose& world_from_camera)
{
  Matrix6d information = Matrix6d::Zero();
  for (const std::size_t i : matched.pose->inliers) {
    Eigen::Matrix<double, 3, 6> by_motion;
    by_motion << -crossMatrix(world_from_camera * matched.points.source[i]),
        Eigen::Matrix3d::Identity();
    information += matched.points.weights[i] / (matched.pose->scale * matched.pose->scale) *
                   by_motion.transpose() * by_motion;
  }
  return information;
}

std::string
percent(double share)
{
  return std::to_string(int(std::lround(100 * share))) + " %";
}

} // namespace

void
setDeviations(const Matrix6d& information, LivePose& pose)
{
  const Matrix6d covariance = poseCovariance(information, pose.world_from_camera);
  pose.rotation_deviation = largestDeviation(covariance.topLeftCorner<3, 3>());
  pose.position_deviation = largestDeviation(covariance.bottomRightCorner<3, 3>());
}

bool
isSmallCorrection(const Pose& correction)
{
  return correction.translation().norm() <= LARGEST_CORRECTION &&
         rotationAngle(correction) <= LARGEST_TURN;
}

void
judge(const BundleICPResult& icp, const Pose& correction, const VisualMatches* matched,
      const Matrix6d& dense, const FrameRegistrationOptions& options, LivePose& pose)
{
  pose.overlap = icp.overlap;
  pose.icp_rmse = icp.rmse;
  pose.inliers = icp.visual_inliers;
  Matrix6d information = dense;
  if (matched)
    information += visualInformation(*matched, pose.world_from_camera);
  setDeviations(information, pose);
  const bool is_meeting =
      hasConverged(icp.status) || (matched && icp.status == BundleICPStatus::REFINEMENT_REJECTED);
  if (!is_meeting || icp.overlap < (matched ? MIN_OVERLAP_SEEN : MIN_OVERLAP) ||
      icp.agreement < (matched ? MIN_AGREEMENT_SEEN : MIN_AGREEMENT))
    pose.reason = percent(icp.overlap) + " of the depth lies on the model, " +
                  percent(icp.agreement) + " of what can tell agrees";
  else if (!matched && !icp.degenerate_directions.empty())
    pose.reason = "the surfaces leave " + std::to_string(icp.degenerate_directions.size()) +
                  " directions of motion open";
  else if (matched && pose.inliers < options.min_visual_inliers)
    pose.reason = "only " + std::to_string(pose.inliers) + " matches agree with it";
  else if (!isSmallCorrection(correction))
    pose.reason = "depth moved it far from its start";
  else if (pose.position_deviation > options.max_position_deviation ||
           pose.rotation_deviation > options.max_rotation_deviation)
    pose.reason = "matches and depth leave the pose open";
  if (pose.reason.empty())
    pose.status = LiveStatus::GOOD;
  else if (icp.overlap >= LOST_OVERLAP && icp.agreement >= LOST_AGREEMENT)
    pose.status = LiveStatus::DOUBTFUL;
}

} // namespace bundle_icp
