// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/graph/features.h>

#include <ceres/ceres.h>

#include <cmath>
#include <memory>

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

/** Rotations change by a rotation vector on the left, translations by addition: six numbers, the
 *  motion of a pose. (ceres::EigenQuaternionManifold takes half the rotation vector.) */
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

/** A cost function of PoseBlocks, those of its blocks that have seven numbers, and of others. Ceres
 *  asks for derivatives by these seven, the library's own solvers for those by the pose's motion.
 *  */
template <int ROWS, int... SIZES>
class PoseResidual : public ceres::SizedCostFunction<ROWS, SIZES...> {
public:
  /** As Evaluate(), but with derivatives by a motion, six columns, instead of those by a pose. */
  virtual void
  linearise(const double* const* parameters, double* residuals, double** jacobians) const = 0;

  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const final
  {
    constexpr int sizes[] = {SIZES...}, count = sizeof...(SIZES);
    Eigen::Matrix<double, ROWS, 6, Eigen::RowMajor> by_motion[count];
    double* by_block[count] = {};
    for (int k = 0; jacobians && k < count; ++k)
      by_block[k] = jacobians[k] && sizes[k] == 7 ? by_motion[k].data() : jacobians[k];
    linearise(parameters, residuals, jacobians ? by_block : nullptr);
    for (int k = 0; jacobians && k < count; ++k) {
      if (!jacobians[k] || sizes[k] != 7)
        continue;
      Eigen::Matrix<double, 6, 7, Eigen::RowMajor> motion_by_pose;
      PoseManifold().MinusJacobian(parameters[k], motion_by_pose.data());
      Eigen::Map<Eigen::Matrix<double, ROWS, 7, Eigen::RowMajor>>{jacobians[k]} =
          by_motion[k] * motion_by_pose;
    }
    return true;
  }
};

/** Data that all residuals of a frame share. */
struct FrameMeasurement {
  const CameraIntrinsics& camera;
  Vector6d motion = Vector6d::Zero(); ///< see MeasurementModel
};

/** (predicted pixel - measured pixel) / sigma. Blocks: pose, point in the world, calibration. */
class PixelResidual final : public PoseResidual<2, 7, 3, NUM_CALIBRATION_PARAMETERS> {
public:
  PixelResidual(const FrameMeasurement& frame, const Features& features, int feature)
  : frame_(frame), pixel_(features.pixels[feature].cast<double>()),
    weight_(1 / features.pixel_sigmas[feature])
  {
  }
  void
  linearise(const double* const* parameters, double* residuals, double** jacobians) const override;

private:
  const FrameMeasurement& frame_;
  Eigen::Vector2d pixel_;
  double weight_;
};

/** (predicted depth - measured depth) / sigma. It is the prediction that errors of the depth camera
 *  are applied to: correcting the measurement would shrink its noise with it, and the fit
 *  would improve by shrinking alone. Blocks: pose, point in the world, calibration, DepthError. */
class DepthResidual final : public PoseResidual<1, 7, 3, NUM_CALIBRATION_PARAMETERS, 3> {
public:
  DepthResidual(const FrameMeasurement& frame, const DepthNoise& noise, const Features& features,
                int feature)
  : frame_(frame), noise_(noise), pixel_(features.pixels[feature].cast<double>()),
    slope_(features.depthSlope(feature).cast<double>()), depth_(features.depths[feature]),
    weight_(1 / features.depth_sigmas[feature])
  {
  }
  void
  linearise(const double* const* parameters, double* residuals, double** jacobians) const override;

private:
  const FrameMeasurement& frame_;
  const DepthNoise& noise_;
  Eigen::Vector2d pixel_;
  Eigen::Vector2d slope_;
  double depth_;
  double weight_;
};

/** Residuals of one observation and their derivatives, each over its sigma and times the root of
 *  its robust weight: two rows for the pixel, one for the depth. */
struct ObservationRows {
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 9> by_frame =
      Eigen::Matrix<double, 3, 9>::Zero(); ///< motion, depth error
  Eigen::Matrix3d by_point = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, NUM_CALIBRATION_PARAMETERS, Eigen::RowMajor> by_calibration =
      Eigen::Matrix<double, 3, NUM_CALIBRATION_PARAMETERS, Eigen::RowMajor>::Zero();
};

/** Residuals that a feature of a point adds to an adjustment. The parameter blocks are those of
 *  DepthResidual. */
struct ObservationResiduals {
  std::unique_ptr<PixelResidual> pixel;
  std::unique_ptr<DepthResidual> depth; ///< null where none was measured

  /** \param noise null when measured depth takes no part */
  ObservationResiduals(const FrameMeasurement& frame, const Features& features, int feature,
                       const DepthNoise* noise);

  /** Sum of the squared residuals under the Cauchy loss. */
  double
  cost(const double* const* blocks, double loss_scale) const;

  ObservationRows
  linearise(const double* const* blocks, double loss_scale, bool by_calibration) const;
};

/** Square root of the information times the motion from the measured to the present relative
 *  pose. Blocks: pose of the first, pose of the second frame. */
class RelativePoseResidual final : public PoseResidual<6, 7, 7> {
public:
  RelativePoseResidual(const Pose& first_from_second, const Matrix6d& information);
  void
  linearise(const double* const* parameters, double* residuals, double** jacobians) const override;

private:
  Pose first_from_second_;
  Matrix6d root_;
};

} // namespace bundle_icp
