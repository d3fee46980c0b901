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

/** Six numbers of the pose, then the three of the depth error. */
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector9d = Eigen::Matrix<double, 9, 1>;

struct NormalEquations {
  Matrix9d hessian = Matrix9d::Zero();
  Vector9d gradient = Vector9d::Zero();

  template <int N>
  void
  add(const Eigen::Matrix<double, N, 1>& error,
      const Eigen::Matrix<double, N, 9>& jacobian,
      double weight)
  {
    hessian += weight * jacobian.transpose() * jacobian;
    gradient += weight * jacobian.transpose() * error;
  }
};

/** Weight of the Cauchy loss. */
double
robustWeight(double squared_error, double loss_scale)
{
  return 1 / (1 + squared_error / (loss_scale * loss_scale));
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
  equations.hessian.topLeftCorner<6, 6>() += jacobian.transpose() * dense.information * jacobian;
  equations.gradient.head<6>() += jacobian.transpose() * dense.information * error;
}

} // namespace

ImagePose
adjustPose(const ImageGraph& graph,
           const SparseModel& model,
           std::size_t image,
           const std::vector<PointObservation>& observations,
           const DensePose& dense,
           const BundleAdjustmentOptions& options,
           bool depth_error,
           const ImagePose& start)
{
  const Features& features = graph.features(image);
  const ImageMeasurement measurement{graph.camera(), model.motion(image)};
  PoseBlock pose(start.world_from_camera);
  DepthError error = start.depth_error;
  const PoseManifold manifold;
  for (int iteration = 0; iteration < MAX_ITERATIONS; ++iteration) {
    NormalEquations equations;
    for (const PointObservation& o : observations) {
      const double* parameters[] = {pose.values,
                                    o.point.data(),
                                    model.calibration().values.data(),
                                    error.data()};
      {
        Eigen::Vector2d residual;
        Eigen::Matrix<double, 2, 7, Eigen::RowMajor> by_pose;
        double* jacobians[] = {by_pose.data(), nullptr, nullptr};
        PixelResidual(measurement, features, o.feature)
            .Evaluate(parameters, residual.data(), jacobians);
        Eigen::Matrix<double, 2, 9> jacobian = Eigen::Matrix<double, 2, 9>::Zero();
        jacobian.leftCols<6>() = by_pose.leftCols<6>();
        equations.add<2>(
            residual, jacobian, robustWeight(residual.squaredNorm(), options.loss_scale));
      }
      if (options.use_depth && features.hasDepth(o.feature)) {
        Eigen::Matrix<double, 1, 1> residual;
        Eigen::Matrix<double, 1, 7> by_pose;
        Eigen::RowVector3d by_error;
        double* jacobians[] = {by_pose.data(), nullptr, nullptr, by_error.data()};
        DepthResidual(measurement, model.depthNoise(), features, o.feature)
            .Evaluate(parameters, residual.data(), jacobians);
        Eigen::Matrix<double, 1, 9> jacobian;
        jacobian << by_pose.leftCols<6>(), by_error;
        equations.add<1>(
            residual, jacobian, robustWeight(residual.squaredNorm(), options.loss_scale));
      }
    }
    addDense(dense, pose, equations);
    Vector9d step = Vector9d::Zero();
    if (depth_error) {
      const double weight = 1 / (options.depth_error_deviation * options.depth_error_deviation);
      equations.hessian.bottomRightCorner<3, 3>().diagonal().array() += weight;
      equations.gradient.tail<3>() += weight * error;
      step = -equations.hessian.ldlt().solve(equations.gradient);
    }
    else
      step.head<6>() = -equations.hessian.topLeftCorner<6, 6>().ldlt().solve(
          equations.gradient.head<6>());
    if (!step.allFinite())
      break;
    const Vector6d motion = step.head<6>();
    manifold.Plus(PoseBlock(pose).values, motion.data(), pose.values);
    error += step.tail<3>();
    if (motion.norm() < STEP_TOLERANCE)
      break;
  }
  return {pose.worldFromCamera(), error};
}

} // namespace bundle_icp
