// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/pose_adjustment.h"

#include "sparse/residuals.h"

#include <Eigen/Dense>

#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

constexpr int MAX_ITERATIONS = 15;
/** Steps below this [rad, m] end the iteration: far less than any pose is known to. */
constexpr double STEP_TOLERANCE = 1e-7;

/** Six numbers of the pose, three of the depth error. */
constexpr int POSE = 0, DEPTH_ERROR = 6, SIZE = 9;
using Matrix = Eigen::Matrix<double, SIZE, SIZE>;
using Vector = Eigen::Matrix<double, SIZE, 1>;

struct NormalEquations {
  Matrix hessian = Matrix::Zero();
  Vector gradient = Vector::Zero();

  template <int N>
  void
  add(const Eigen::Matrix<double, N, 1>& error,
      const Eigen::Matrix<double, N, SIZE>& jacobian,
      double weight)
  {
    hessian += weight * jacobian.transpose() * jacobian;
    gradient += weight * jacobian.transpose() * error;
  }

  /** Adds a prior, each number with its own deviation. */
  void
  addPrior(int first, const Eigen::VectorXd& error, const Eigen::VectorXd& deviations)
  {
    const Eigen::VectorXd weights = deviations.array().square().inverse();
    hessian.diagonal().segment(first, error.size()) += weights;
    gradient.segment(first, error.size()) += weights.cwiseProduct(error);
  }

  /** Keeps numbers where they are. */
  void
  hold(int first, int count)
  {
    hessian.middleCols(first, count).setZero();
    hessian.middleRows(first, count).setZero();
    hessian.diagonal().segment(first, count).setOnes();
    gradient.segment(first, count).setZero();
  }
};

void
addPixel(const ImageMeasurement& measurement,
         const Features& features,
         int feature,
         const double* const* parameters,
         const BundleAdjustmentOptions& options,
         NormalEquations& equations)
{
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> by_pose;
  double* jacobians[] = {by_pose.data(), nullptr, nullptr};
  PixelResidual(measurement, features, feature).Evaluate(parameters, residual.data(), jacobians);
  Eigen::Matrix<double, 2, SIZE> jacobian = Eigen::Matrix<double, 2, SIZE>::Zero();
  jacobian.middleCols<6>(POSE) = by_pose.leftCols<6>();
  equations.add<2>(residual, jacobian, robustWeight(residual.squaredNorm(), options.loss_scale));
}

void
addDepth(const ImageMeasurement& measurement,
         const DepthNoise& noise,
         const Features& features,
         int feature,
         const double* const* parameters,
         const BundleAdjustmentOptions& options,
         NormalEquations& equations)
{
  Eigen::Matrix<double, 1, 1> residual;
  Eigen::Matrix<double, 1, 7> by_pose;
  Eigen::RowVector3d by_error;
  double* jacobians[] = {by_pose.data(), nullptr, nullptr, by_error.data()};
  DepthResidual(measurement, noise, features, feature)
      .Evaluate(parameters, residual.data(), jacobians);
  Eigen::Matrix<double, 1, SIZE> jacobian = Eigen::Matrix<double, 1, SIZE>::Zero();
  jacobian.middleCols<6>(POSE) = by_pose.leftCols<6>();
  jacobian.middleCols<3>(DEPTH_ERROR) = by_error;
  equations.add<1>(residual, jacobian, robustWeight(residual.squaredNorm(), options.loss_scale));
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

double
largestDeviation(const Eigen::Matrix3d& covariance)
{
  const double largest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().maxCoeff();
  return largest >= 0 ? std::sqrt(largest) : std::numeric_limits<double>::infinity();
}

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
  NormalEquations equations;
  for (int iteration = 0; iteration < MAX_ITERATIONS; ++iteration) {
    equations = {};
    for (const PointObservation& o : observations) {
      const double* parameters[] = {
          pose.values, o.point.data(), model.calibration().values.data(), error.data()};
      addPixel(measurement, features, o.feature, parameters, options, equations);
      if (options.use_depth && features.hasDepth(o.feature))
        addDepth(measurement, graph.camera().depth_noise, features, o.feature, parameters, options, equations);
    }
    addDense(dense, pose, equations);
    if (depth_error)
      equations.addPrior(
          DEPTH_ERROR, error, Eigen::Vector3d::Constant(options.depth_error_deviation));
    else
      equations.hold(DEPTH_ERROR, 3);
    const Vector step = -equations.hessian.ldlt().solve(equations.gradient);
    if (!step.allFinite())
      break;
    const Vector6d moved = step.segment<6>(POSE);
    manifold.Plus(PoseBlock(pose).values, moved.data(), pose.values);
    error += step.segment<3>(DEPTH_ERROR);
    if (moved.norm() < STEP_TOLERANCE)
      break;
  }
  ImagePose result{pose.worldFromCamera(), error};
  // A motion (w, v) of camera_from_world = (R, t) turns the camera by -R' w and moves it by
  // -R' (v + t x w).
  Matrix6d world_by_motion = Matrix6d::Zero();
  const Eigen::Matrix3d axes = result.world_from_camera.linear();
  world_by_motion.topLeftCorner<3, 3>() = -axes;
  world_by_motion.bottomRightCorner<3, 3>() = -axes;
  world_by_motion.bottomLeftCorner<3, 3>() =
      -axes * crossMatrix(result.world_from_camera.inverse().translation());
  equations.hessian.diagonal().segment<6>(POSE).array() += PRIOR_INFORMATION;
  const Matrix inverse = equations.hessian.ldlt().solve(Matrix::Identity());
  result.covariance =
      world_by_motion * inverse.topLeftCorner<6, 6>() * world_by_motion.transpose();
  return result;
}

} // namespace bundle_icp
