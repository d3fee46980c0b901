// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/residuals.h"

#include "model/measurement_model.h"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace bundle_icp {
namespace {

using RowMatrix66 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
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

/** Derivative of a quaternion (x y z w) by a rotation vector on its left, at zero: that of (w / 2,
 *  1) q. */
Eigen::Matrix<double, 4, 3>
quaternionByRotation(const double* block)
{
  const auto q = rotationOf(block);
  Eigen::Matrix<double, 4, 3> jacobian;
  jacobian << q.w() * Eigen::Matrix3d::Identity() - crossMatrix(q.vec()), -q.vec().transpose();
  return 0.5 * jacobian;
}

/** Derivative of the rotation vector of exp(w) exp(rotation) by w, at zero: the inverse of the left
 *  Jacobian of SO(3). */
Eigen::Matrix3d
rotationByLeft(const Eigen::Vector3d& rotation)
{
  const double angle = rotation.norm();
  const Eigen::Matrix3d cross = crossMatrix(rotation);
  // By its series where the exact factor would be 0 / 0.
  const double factor = angle < 1e-3 ? 1.0 / 12 + angle * angle / 720
                                     : 1 / (angle * angle) - 0.5 / (angle * std::tan(angle / 2));
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

/** Derivative of the point in the camera by the pose's motion: [-[R X]x | I]. */
Eigen::Matrix<double, 3, 6>
pointByMotion(const Eigen::Vector3d& rotated)
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
PoseManifold::PlusJacobian(const double* x, double* jacobian) const
{
  Eigen::Map<RowMatrix76> plus(jacobian);
  plus.setZero();
  plus.topLeftCorner<4, 3>() = quaternionByRotation(x);
  plus.bottomRightCorner<3, 3>().setIdentity();
  return true;
}

bool
PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const
{
  Pose motion = Pose::Identity();
  motion.linear() = (rotationOf(y) * rotationOf(x).inverse()).normalized().toRotationMatrix();
  motion.translation() = translationOf(y) - translationOf(x);
  Eigen::Map<Vector6d>{y_minus_x} = logarithm(motion);
  return true;
}

bool
PoseManifold::MinusJacobian(const double* x, double* jacobian) const
{
  // The columns of quaternionByRotation() are orthogonal and of length 1/2.
  Eigen::Map<RowMatrix67> minus(jacobian);
  minus.setZero();
  minus.topLeftCorner<3, 4>() = 4 * quaternionByRotation(x).transpose();
  minus.bottomRightCorner<3, 3>().setIdentity();
  return true;
}

void
PixelResidual::linearise(const double* const* parameters, double* residuals,
                         double** jacobians) const
{
  const Eigen::Matrix3d rotation = rotationOf(parameters[0]).toRotationMatrix();
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  const MeasurementModel model(frame_.camera, Eigen::Map<const CalibrationVector>(parameters[2]),
                               frame_.motion);
  Eigen::Matrix<double, 2, 3> by_point;
  CalibrationRows2 by_calibration;
  const Eigen::Vector2d predicted = model.pixel(
      rotated + translationOf(parameters[0]), pixel_.y(), jacobians ? &by_point : nullptr,
      jacobians && jacobians[2] ? &by_calibration : nullptr);
  Eigen::Map<Eigen::Vector2d>{residuals} = weight_ * (predicted - pixel_);
  if (!jacobians)
    return;
  by_point *= weight_;
  if (jacobians[0])
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>>{jacobians[0]} =
        by_point * pointByMotion(rotated);
  if (jacobians[1])
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[1]} = by_point * rotation;
  if (jacobians[2])
    Eigen::Map<Eigen::Matrix<double, 2, NUM_CALIBRATION_PARAMETERS, Eigen::RowMajor>>{
        jacobians[2]} = weight_ * by_calibration;
}

void
DepthResidual::linearise(const double* const* parameters, double* residuals,
                         double** jacobians) const
{
  const Eigen::Matrix3d rotation = rotationOf(parameters[0]).toRotationMatrix();
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  const Eigen::Map<const CalibrationVector> calibration(parameters[2]);
  const MeasurementModel model(frame_.camera, calibration, frame_.motion);
  const Eigen::Vector2d shift(calibration[int(CalibrationParameter::DEPTH_SHIFT_X)],
                              calibration[int(CalibrationParameter::DEPTH_SHIFT_Y)]);
  Eigen::RowVector3d by_point, by_error;
  CalibrationRow by_calibration;
  const double predicted = model.depth(
      rotated + translationOf(parameters[0]), pixel_, Eigen::Map<const DepthError>(parameters[3]),
      noise_, jacobians ? &by_point : nullptr,
      jacobians && jacobians[2] ? &by_calibration : nullptr, jacobians ? &by_error : nullptr);
  residuals[0] = weight_ * (predicted - depth_ - slope_.dot(shift));
  if (!jacobians)
    return;
  if (jacobians[0])
    Eigen::Map<Eigen::Matrix<double, 1, 6>>{jacobians[0]} =
        weight_ * by_point * pointByMotion(rotated);
  if (jacobians[1])
    Eigen::Map<Eigen::RowVector3d>{jacobians[1]} = weight_ * by_point * rotation;
  if (jacobians[2]) {
    by_calibration[int(CalibrationParameter::DEPTH_SHIFT_X)] = -slope_.x();
    by_calibration[int(CalibrationParameter::DEPTH_SHIFT_Y)] = -slope_.y();
    Eigen::Map<CalibrationRow>{jacobians[2]} = weight_ * by_calibration;
  }
  if (jacobians[3])
    Eigen::Map<Eigen::RowVector3d>{jacobians[3]} = weight_ * by_error;
}

ObservationResiduals::ObservationResiduals(const FrameMeasurement& frame, const Features& features,
                                           int feature, const DepthNoise* noise)
: pixel(std::make_unique<PixelResidual>(frame, features, feature))
{
  if (noise && features.hasDepth(feature))
    depth = std::make_unique<DepthResidual>(frame, *noise, features, feature);
}

double
ObservationResiduals::cost(const double* const* blocks, double loss_scale) const
{
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  pixel->linearise(blocks, residual.data(), nullptr);
  if (depth)
    depth->linearise(blocks, &residual[2], nullptr);
  return robustCost(residual.head<2>().squaredNorm(), loss_scale) +
         robustCost(residual[2] * residual[2], loss_scale);
}

ObservationRows
ObservationResiduals::linearise(const double* const* blocks, double loss_scale,
                                bool by_calibration) const
{
  ObservationRows rows;
  Eigen::Matrix<double, 3, 6, Eigen::RowMajor> by_motion = Eigen::Matrix<double, 3, 6>::Zero();
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> by_point = Eigen::Matrix3d::Zero();
  Eigen::RowVector3d by_error = Eigen::RowVector3d::Zero();
  double* of_pixel[] = {by_motion.data(), by_point.data(),
                        by_calibration ? rows.by_calibration.data() : nullptr};
  pixel->linearise(blocks, rows.residual.data(), of_pixel);
  if (depth) {
    double* of_depth[] = {by_motion.row(2).data(), by_point.row(2).data(),
                          by_calibration ? rows.by_calibration.row(2).data() : nullptr,
                          by_error.data()};
    depth->linearise(blocks, &rows.residual[2], of_depth);
  }
  const double pixel_weight =
      std::sqrt(robustWeight(rows.residual.head<2>().squaredNorm(), loss_scale));
  const double depth_weight =
      std::sqrt(robustWeight(rows.residual[2] * rows.residual[2], loss_scale));
  const Eigen::Vector3d weights(pixel_weight, pixel_weight, depth_weight);
  rows.residual = weights.cwiseProduct(rows.residual);
  rows.by_frame.leftCols<6>() = weights.asDiagonal() * by_motion;
  rows.by_frame.bottomRightCorner<1, 3>() = depth_weight * by_error;
  rows.by_point = weights.asDiagonal() * by_point;
  if (by_calibration)
    rows.by_calibration = weights.asDiagonal() * rows.by_calibration;
  return rows;
}

RelativePoseResidual::RelativePoseResidual(const Pose& first_from_second,
                                           const Matrix6d& information)
: first_from_second_(first_from_second)
{
  // Not a Cholesky factor: the information may be singular along free directions.
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  root_ =
      eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
}

void
RelativePoseResidual::linearise(const double* const* parameters, double* residuals,
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
    return;

  // A motion (w, v) on the left of the relative pose turns the error's rotation and adds w x t + v
  // to its translation t.
  Matrix6d by_left = Matrix6d::Identity();
  by_left.topLeftCorner<3, 3>() = rotationByLeft(error.head<3>());
  by_left.bottomLeftCorner<3, 3>() = -crossMatrix(error.tail<3>());
  // The block's rotation w1 leaves t1 alone: it moves the relative pose by (w1, v1 - w1 x t1).
  Matrix6d by_first = Matrix6d::Identity();
  by_first.bottomLeftCorner<3, 3>() = crossMatrix(t1);
  Matrix6d by_second = Matrix6d::Zero();
  by_second.topLeftCorner<3, 3>() = -r12;
  by_second.bottomRightCorner<3, 3>() = -r12;
  by_second.bottomLeftCorner<3, 3>() = -crossMatrix(t1) * r12;
  const RowMatrix66 by_error = root_ * by_left;
  if (jacobians[0])
    Eigen::Map<RowMatrix66>{jacobians[0]} = by_error * by_first;
  if (jacobians[1])
    Eigen::Map<RowMatrix66>{jacobians[1]} = by_error * by_second;
}

} // namespace bundle_icp
