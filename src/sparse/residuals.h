// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/graph/features.h>

#include <ceres/ceres.h>

#include <cmath>

namespace bundle_icp {

/** The Cauchy loss on a squared residual, over its sigma: its cost ... */
inline double
robustCost(double squared_error, double loss_scale)
{
  return loss_scale * loss_scale * std::log1p(squared_error / (loss_scale * loss_scale));
}

/** ... and its weight in reweighted least squares. */
inline double
robustWeight(double squared_error, double loss_scale)
{
  return 1 / (1 + squared_error / (loss_scale * loss_scale));
}

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

/** What an image's residuals share. */
struct ImageMeasurement {
  const CameraIntrinsics& camera;
  Vector6d motion = Vector6d::Zero(); ///< see MeasurementModel
};

/** (predicted pixel - measured pixel) / sigma. Blocks: pose, point in the world, calibration. */
class PixelResidual : public ceres::SizedCostFunction<2, 7, 3, NUM_CALIBRATION_PARAMETERS> {
public:
  PixelResidual(const ImageMeasurement& image, const Features& features, int feature)
  : image_(image)
  , pixel_(features.pixels[feature].cast<double>())
  , weight_(1 / features.pixel_sigmas[feature])
  {
  }
  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

private:
  const ImageMeasurement& image_;
  Eigen::Vector2d pixel_;
  double weight_;
};

/** (predicted depth - measured depth) / sigma. It is the prediction that errors of the depth camera
 *  are applied to: correcting the measurement would shrink its noise with it, and the fit
 *  would improve by shrinking alone. Blocks: pose, point in the world, calibration, DepthError. */
class DepthResidual : public ceres::SizedCostFunction<1, 7, 3, NUM_CALIBRATION_PARAMETERS, 3> {
public:
  DepthResidual(const ImageMeasurement& image,
                const DepthNoise& noise,
                const Features& features,
                int feature)
  : image_(image)
  , noise_(noise)
  , pixel_(features.pixels[feature].cast<double>())
  , slope_(features.depthSlope(feature).cast<double>())
  , depth_(features.depths[feature])
  , weight_(1 / features.depth_sigmas[feature])
  {
  }
  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

private:
  const ImageMeasurement& image_;
  const DepthNoise& noise_;
  Eigen::Vector2d pixel_;
  Eigen::Vector2d slope_;
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
