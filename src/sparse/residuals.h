// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <ceres/ceres.h>

namespace bundle_icp {

/** A pose as a parameter block: quaternion (x y z w), translation of camera_from_world. */
struct PoseBlock {
  double values[7];

  explicit PoseBlock(const Pose& world_from_camera = Pose::Identity());

  Pose
  worldFromCamera() const;
};

/** Rotations change by a rotation vector on the left, translations by addition.
 *
 *  The residuals below write their derivatives by these six numbers into the first six columns of the
 *  Jacobian for the block's seven; PlusJacobian() picks them. This spares the detour over
 *  the derivatives by a quaternion. */
class PoseManifold : public ceres::Manifold {
public:
  int
  AmbientSize() const override
  {
    return 7;
  }
  int
  TangentSize() const override
  {
    return 6;
  }
  bool
  Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool
  PlusJacobian(const double* x, double* jacobian) const override;
  bool
  Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool
  MinusJacobian(const double* x, double* jacobian) const override;
};

/** (projected point - measured pixel) / sigma. Blocks: pose, point in the world. */
class PixelResidual : public ceres::SizedCostFunction<2, 7, 3> {
public:
  PixelResidual(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel, double sigma)
  : camera_(camera), pixel_(pixel), weight_(1 / sigma)
  {
  }
  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

private:
  const CameraIntrinsics& camera_;
  Eigen::Vector2d pixel_;
  double weight_;
};

/** (depth of the point along the axis - measured depth) / sigma. Blocks: pose, point. */
class DepthResidual : public ceres::SizedCostFunction<1, 7, 3> {
public:
  DepthResidual(double depth, double sigma) : depth_(depth), weight_(1 / sigma) {}
  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

private:
  double depth_;
  double weight_;
};

/** Square root of the information times the motion from the measured to the present relative
 *  pose. Blocks: pose of the first, pose of the second image. */
class RelativePoseResidual : public ceres::SizedCostFunction<6, 7, 7> {
public:
  RelativePoseResidual(const Pose& first_from_second, const Matrix6d& information);
  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

private:
  Pose first_from_second_;
  Matrix6d root_;
};

} // namespace bundle_icp
