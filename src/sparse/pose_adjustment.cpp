// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/pose_adjustment.h"

#include "sparse/residuals.h"

#include <Eigen/Dense>

namespace bundle_icp {
namespace {

constexpr int MAX_ITERATIONS = 15;
/** Steps below this [rad, m] end the iteration: far less than any pose is known to. */
constexpr double STEP_TOLERANCE = 1e-7;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

/** Adds a residual block with the Cauchy loss: weight 1 / (1 + |r|^2 / c^2). */
template <int N>
void
addResidual(const ceres::CostFunction& residual,
            const PoseBlock& pose,
            const Eigen::Vector3d& point,
            double loss_scale,
            NormalEquations& equations)
{
  Eigen::Matrix<double, N, 1> error;
  Eigen::Matrix<double, N, 7, Eigen::RowMajor> by_pose;
  const double* parameters[] = {pose.values, point.data()};
  double* jacobians[] = {by_pose.data(), nullptr};
  residual.Evaluate(parameters, error.data(), jacobians);
  const double weight = 1 / (1 + error.squaredNorm() / (loss_scale * loss_scale));
  const Eigen::Matrix<double, N, 6> jacobian = by_pose.template leftCols<6>();
  equations.hessian += weight * jacobian.transpose() * jacobian;
  equations.gradient += weight * jacobian.transpose() * error;
}

/** Adds the dense evidence, whose motions are of world_from_camera; those of the block are of its
 *  inverse: rotation on the left, translation added. */
void
addDense(const DensePose& dense, const PoseBlock& pose, NormalEquations& equations)
{
  const Pose world_from_camera = pose.worldFromCamera();
  const Vector6d error = logarithm(world_from_camera * dense.world_from_camera.inverse());
  // A motion (w, v) of camera_from_world is one of (-R w, -R v) of world_from_camera.
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = -world_from_camera.linear();
  jacobian.bottomRightCorner<3, 3>() = -world_from_camera.linear();
  equations.hessian += jacobian.transpose() * dense.information * jacobian;
  equations.gradient += jacobian.transpose() * dense.information * error;
}

} // namespace

Pose
adjustPose(const Features& features,
           const CameraIntrinsics& camera,
           const std::vector<PointObservation>& observations,
           const DensePose& dense,
           const BundleAdjustmentOptions& options,
           const Pose& world_from_camera)
{
  PoseBlock pose(world_from_camera);
  const PoseManifold manifold;
  for (int iteration = 0; iteration < MAX_ITERATIONS; ++iteration) {
    NormalEquations equations;
    for (const PointObservation& o : observations) {
      addResidual<2>(PixelResidual(camera,
                                   features.pixels[o.feature].cast<double>(),
                                   features.pixel_sigmas[o.feature]),
                     pose,
                     o.point,
                     options.loss_scale,
                     equations);
      if (options.use_depth && features.hasDepth(o.feature))
        addResidual<1>(
            DepthResidual(features.depths[o.feature], features.depth_sigmas[o.feature]),
            pose,
            o.point,
            options.loss_scale,
            equations);
    }
    addDense(dense, pose, equations);
    const Vector6d step = -equations.hessian.ldlt().solve(equations.gradient);
    if (!step.allFinite())
      break;
    manifold.Plus(PoseBlock(pose).values, step.data(), pose.values);
    if (step.norm() < STEP_TOLERANCE)
      break;
  }
  return pose.worldFromCamera();
}

} // namespace bundle_icp
