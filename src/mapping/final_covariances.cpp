// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/final_covariances.h"

#include "adjustment/pose_covariances.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>

namespace bundle_icp {
namespace {

/** What a motion that turns and moves one camera does to a camera that is fixed to it. */
Matrix6d
transport(const Pose& from, const Pose& to)
{
  Matrix6d result = Matrix6d::Identity();
  result.bottomLeftCorner<3, 3>() = -crossMatrix(to.translation() - from.translation());
  return result;
}

/** The adjusted frame next to another frame. */
std::size_t
nearestAdjusted(const SparseModel& model, const std::vector<std::size_t>& adjusted,
                std::size_t frame)
{
  const auto distance = [&](std::size_t other) {
    const Pose motion = model.worldFromCamera(frame).inverse() * model.worldFromCamera(other);
    return motion.translation().norm() + rotationAngle(motion);
  };
  return *std::min_element(adjusted.begin(), adjusted.end(),
                           [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
}

/** What the motion prior takes away refers to the pose alone, and may exceed what is known of it
 *  together with others: no motion is known better than the prior's own result knows the best one.
 *  Infinite where nothing is known. */
Matrix6d
atLeast(const Matrix6d& covariance, const FinalPose& pose)
{
  if (!covariance.allFinite())
    return Matrix6d(Vector6d::Constant(std::numeric_limits<double>::infinity()).asDiagonal());
  const Matrix6d smoothed = pose.own + pose.change;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> least(smoothed, Eigen::EigenvaluesOnly);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(covariance);
  const Vector6d values = solver.eigenvalues().cwiseMax(std::max(0.0, least.eigenvalues()[0]));
  return solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
}

} // namespace

FinalCovariances
finalCovariances(const ImageGraph& graph, const SparseModel& model,
                 BundleAdjustmentProblem evidence, const BundleAdjustmentOptions& options,
                 const std::vector<FinalPose>& poses)
{
  const FinalPose& first = poses.front();
  std::vector<std::size_t>& adjusted = evidence.variable;
  adjusted.clear(); // a frame that was registered by geometry alone has no evidence among them
  for (const FinalPose& pose : poses)
    if (pose.is_adjusted)
      adjusted.push_back(pose.frame);
  std::vector<std::size_t> base; // the adjusted frame that each pose hangs on
  for (const FinalPose& pose : poses)
    base.push_back(pose.is_adjusted ? pose.frame : nearestAdjusted(model, adjusted, pose.frame));
  // The first of the variable frames keeps its pose.
  std::iter_swap(adjusted.begin(), std::find(adjusted.begin(), adjusted.end(), base.front()));
  const std::vector<Matrix6d> together = poseCovariances(graph, evidence, options, model);
  std::map<std::size_t, Matrix6d> joint;
  for (std::size_t k = 0; k < adjusted.size(); ++k)
    joint[adjusted[k]] = together[k];
  const auto ownPart = [](const FinalPose& pose) -> Matrix6d {
    return pose.is_adjusted ? pose.change : pose.own + pose.change;
  };
  const Pose& first_pose = model.worldFromCamera(first.frame);
  Matrix6d axes = Matrix6d::Zero();
  axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = first_pose.linear().transpose();
  FinalCovariances result{{first.frame, Matrix6d::Zero()}};
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const Pose& pose = model.worldFromCamera(poses[k].frame);
    const Matrix6d by_base = transport(model.worldFromCamera(base[k]), pose);
    const Matrix6d by_first = transport(first_pose, pose);
    const Matrix6d covariance = by_base * joint[base[k]] * by_base.transpose() +
                                by_first * ownPart(first) * by_first.transpose() +
                                ownPart(poses[k]);
    result.emplace_back(poses[k].frame, axes * atLeast(covariance, poses[k]) * axes.transpose());
  }
  return result;
}

} // namespace bundle_icp
