// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/residuals.h"

#include <Eigen/Eigenvalues>

namespace bundle_icp {
namespace {

using RowMatrix67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;
using RowMatrix76 = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;

Eigen::Map<const Eigen::Quaterniond>
rotationOf(const double* block)
{
  return Eigen::Map<const Eigen::Quaterniond>(block);
}

Eigen::Map<const Eigen::Vector3d>
translationOf(const double* block)
{
  return Eigen::Map<const Eigen::Vector3d>(block + 4);
}

/** Derivative of the point in the camera by the pose's six numbers: [-[R X]x | I]. */
Eigen::Matrix<double, 3, 6>
pointByPose(const Eigen::Vector3d& rotated)
{
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << -crossMatrix(rotated), Eigen::Matrix3d::Identity();
  return jacobian;
}

} // namespace

PoseBlock::PoseBlock(const Pose& world_from_camera)
{
  const Pose camera_from_world = world_from_camera.inverse();
  Eigen::Map<Eigen::Quaterniond>{values} = Eigen::Quaterniond(camera_from_world.linear());
  Eigen::Map<Eigen::Vector3d>{values + 4} = camera_from_world.translation();
}

Pose
PoseBlock::worldFromCamera() const
{
  Pose camera_from_world = Pose::Identity();
  camera_from_world.linear() = rotationOf(values).normalized().toRotationMatrix();
  camera_from_world.translation() = translationOf(values);
  return camera_from_world.inverse();
}

bool
PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const
{
  const Vector6d motion = Eigen::Map<const Vector6d>(delta);
  const Eigen::Quaterniond rotation(increment(motion).linear());
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = (rotation * rotationOf(x)).normalized();
  Eigen::Map<Eigen::Vector3d>{x_plus_delta + 4} = translationOf(x) + motion.tail<3>();
  return true;
}

bool
PoseManifold::PlusJacobian(const double*, double* jacobian) const
{
  Eigen::Map<RowMatrix76>{jacobian}.setIdentity();
  return true;
}

bool
PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const
{
  Pose motion = Pose::Identity();
  motion.linear() = (rotationOf(y) * rotationOf(x).inverse()).toRotationMatrix();
  motion.translation() = translationOf(y) - translationOf(x);
  Eigen::Map<Vector6d>{y_minus_x} = logarithm(motion);
  return true;
}

bool
PoseManifold::MinusJacobian(const double*, double* jacobian) const
{
  Eigen::Map<RowMatrix67>{jacobian}.setIdentity();
  return true;
}

bool
PixelResidual::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const
{
  const auto rotation = rotationOf(parameters[0]);
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  const Eigen::Vector3d point = rotated + translationOf(parameters[0]);
  // Behind the camera there is no pixel; a far one keeps the block valid and is downweighted.
  const double z = std::max(point.z(), 1e-3);
  Eigen::Map<Eigen::Vector2d>{residuals} =
      weight_ * (camera_.project({point.x(), point.y(), z}) - pixel_);
  if (!jacobians)
    return true;
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << camera_.fx / z, 0, -camera_.fx * point.x() / (z * z), 0, camera_.fy / z,
      -camera_.fy * point.y() / (z * z);
  if (point.z() < z) // the bound does not move with the point
    by_point.col(2).setZero();
  by_point *= weight_;
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
    by_pose.leftCols<6>() = by_point * pointByPose(rotated);
    by_pose.col(6).setZero();
  }
  if (jacobians[1])
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[1]} =
        by_point * rotation.toRotationMatrix();
  return true;
}

bool
DepthResidual::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const
{
  const auto rotation = rotationOf(parameters[0]);
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  residuals[0] = weight_ * (rotated.z() + parameters[0][6] - depth_);
  if (!jacobians)
    return true;
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 1, 7>> by_pose(jacobians[0]);
    by_pose.leftCols<6>() = weight_ * pointByPose(rotated).row(2);
    by_pose[6] = 0;
  }
  if (jacobians[1])
    Eigen::Map<Eigen::Matrix<double, 1, 3>>{jacobians[1]} =
        weight_ * rotation.toRotationMatrix().row(2);
  return true;
}

RelativePoseResidual::RelativePoseResidual(const Pose& first_from_second,
                                           const Matrix6d& information)
: first_from_second_(first_from_second)
{
  // Not a Cholesky factor: the information may be singular along free directions.
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  root_ = eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
          eigen.eigenvectors().transpose();
}

bool
RelativePoseResidual::Evaluate(double const* const* parameters,
                               double* residuals,
                               double** jacobians) const
{
  const auto q1 = rotationOf(parameters[0]), q2 = rotationOf(parameters[1]);
  const Eigen::Vector3d t1 = translationOf(parameters[0]), t2 = translationOf(parameters[1]);
  // first_from_second = camera1_from_world * world_from_camera2
  const Eigen::Matrix3d r12 = (q1 * q2.inverse()).toRotationMatrix();
  Pose relative = Pose::Identity();
  relative.linear() = r12;
  relative.translation() = t1 - r12 * t2;
  const Vector6d error = logarithm(relative * first_from_second_.inverse());
  Eigen::Map<Vector6d>{residuals} = root_ * error;
  if (!jacobians)
    return true;

  // To first order in the error: a motion (w, v) on the left of the relative pose adds
  // (w, v + w x t) to it, where t is the error's translation.
  Matrix6d by_left = Matrix6d::Identity();
  by_left.bottomLeftCorner<3, 3>() = -crossMatrix(error.tail<3>());
  // The block's rotation w1 leaves t1 alone: it moves the relative pose by (w1, v1 - w1 x t1).
  Matrix6d by_first = Matrix6d::Identity();
  by_first.bottomLeftCorner<3, 3>() = crossMatrix(t1);
  Matrix6d by_second = Matrix6d::Zero();
  by_second.topLeftCorner<3, 3>() = -r12;
  by_second.bottomRightCorner<3, 3>() = -r12;
  by_second.bottomLeftCorner<3, 3>() = -crossMatrix(t1) * r12;
  if (jacobians[0]) {
    Eigen::Map<RowMatrix67> jacobian(jacobians[0]);
    jacobian.leftCols<6>() = root_ * by_left * by_first;
    jacobian.col(6).setZero();
  }
  if (jacobians[1]) {
    Eigen::Map<RowMatrix67> jacobian(jacobians[1]);
    jacobian.leftCols<6>() = root_ * by_left * by_second;
    jacobian.col(6).setZero();
  }
  return true;
}

} // namespace bundle_icp
