// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/residuals.h"

#include "sparse/measurement_model.h"

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
  const Eigen::Matrix3d rotation = rotationOf(parameters[0]).toRotationMatrix();
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  const MeasurementModel model(
      image_.camera, Eigen::Map<const CalibrationVector>(parameters[2]), image_.motion);
  Eigen::Matrix<double, 2, 3> by_point;
  CalibrationRows2 by_calibration;
  const Eigen::Vector2d predicted = model.pixel(rotated + translationOf(parameters[0]),
                                                pixel_.y(),
                                                jacobians ? &by_point : nullptr,
                                                jacobians && jacobians[2] ? &by_calibration : nullptr);
  Eigen::Map<Eigen::Vector2d>{residuals} = weight_ * (predicted - pixel_);
  if (!jacobians)
    return true;
  by_point *= weight_;
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
    by_pose.leftCols<6>() = by_point * pointByPose(rotated);
    by_pose.col(6).setZero();
  }
  if (jacobians[1])
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[1]} = by_point * rotation;
  if (jacobians[2])
    Eigen::Map<Eigen::Matrix<double, 2, NUM_CALIBRATION_PARAMETERS, Eigen::RowMajor>>{
        jacobians[2]} = weight_ * by_calibration;
  return true;
}

bool
DepthResidual::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const
{
  const Eigen::Matrix3d rotation = rotationOf(parameters[0]).toRotationMatrix();
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  const Eigen::Map<const CalibrationVector> calibration(parameters[2]);
  const MeasurementModel model(image_.camera, calibration, image_.motion);
  const Eigen::Vector2d shift(calibration[int(CalibrationParameter::DEPTH_SHIFT_X)],
                              calibration[int(CalibrationParameter::DEPTH_SHIFT_Y)]);
  Eigen::RowVector3d by_point, by_error;
  CalibrationRow by_calibration;
  const double predicted = model.depth(rotated + translationOf(parameters[0]),
                                       pixel_,
                                       Eigen::Map<const DepthError>(parameters[3]),
                                       noise_,
                                       jacobians ? &by_point : nullptr,
                                       jacobians && jacobians[2] ? &by_calibration : nullptr,
                                       jacobians ? &by_error : nullptr);
  residuals[0] = weight_ * (predicted - depth_ - slope_.dot(shift));
  if (!jacobians)
    return true;
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 1, 7>> by_pose(jacobians[0]);
    by_pose.leftCols<6>() = weight_ * by_point * pointByPose(rotated);
    by_pose[6] = 0;
  }
  if (jacobians[1])
    Eigen::Map<Eigen::RowVector3d>{jacobians[1]} = weight_ * by_point * rotation;
  if (jacobians[2]) {
    by_calibration[int(CalibrationParameter::DEPTH_SHIFT_X)] = -slope_.x();
    by_calibration[int(CalibrationParameter::DEPTH_SHIFT_Y)] = -slope_.y();
    Eigen::Map<CalibrationRow>{jacobians[2]} = weight_ * by_calibration;
  }
  if (jacobians[3])
    Eigen::Map<Eigen::RowVector3d>{jacobians[3]} = weight_ * by_error;
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
