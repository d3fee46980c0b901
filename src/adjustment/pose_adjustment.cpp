// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/pose_adjustment.h"

#include "adjustment/residuals.h"
#include "common/levenberg_marquardt.h"

#include <Eigen/Dense>

#include <array>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

constexpr int MAX_ITERATIONS = 15;
/** The pose then moves by far less than it is known to. */
constexpr double FUNCTION_TOLERANCE = 1e-8;

/** Fewer residuals do not show how exact they are. */
constexpr double MIN_RESIDUALS = 30;
/** Of a residual, over that which its sigma says: no observations are as exact as those that agree
 *  by chance. */
constexpr double LEAST_VARIANCE = 0.0625;

/** Six numbers of the motion, three of the depth error. */
constexpr int SIZE = 9;
using Matrix = Eigen::Matrix<double, SIZE, SIZE>;
using Vector = Eigen::Matrix<double, SIZE, 1>;

struct PoseState {
  PoseBlock pose;
  DepthError depth_error;
};

/** A problem as minimise() takes it: the pose and the depth error of one frame. */
class PoseProblem {
public:
  PoseProblem(const FrameMeasurement& measurement, const Features& features,
              const SparseModel& model, const std::vector<PointObservation>& observations,
              const DensePoseTerm& dense, const BundleAdjustmentOptions& options,
              bool depth_error_moves)
  : calibration_(model.calibration().values), points_(observations),
    dense_(dense.world_from_camera, dense.information), options_(options),
    depth_error_moves_(depth_error_moves)
  {
    for (const PointObservation& o : observations)
      observations_.emplace_back(measurement, features, o.feature,
                                 options.use_depth ? &measurement.camera.depth_noise : nullptr);
  }

  double
  cost(const PoseState& state) const;

  void
  build(const PoseState& state, double damping);

  std::optional<LeastSquaresStep<PoseState>>
  solve(const PoseState& state) const;

  /** What is known where the equations were built last: observations count as exact as they proved
   *  to be together, since pixels are found better in sharp frames than in blurred ones, and points
   *  of long tracks are known better than those of short ones. */
  Matrix
  information() const;

private:
  std::array<const double*, 4>
  blocks(std::size_t k, const PoseState& state) const
  {
    return {state.pose.values, points_[k].point.data(), calibration_.data(),
            state.depth_error.data()};
  }

  const CalibrationVector& calibration_;
  const std::vector<PointObservation>& points_;
  std::vector<ObservationResiduals> observations_;
  const PoseBlock world_; ///< the dense evidence is of the camera relative to it
  const RelativePoseResidual dense_;
  const BundleAdjustmentOptions& options_;
  const bool depth_error_moves_;
  double damping_ = 0;
  Matrix hessian_ = Matrix::Zero();
  Matrix observed_ = Matrix::Zero(); ///< the part of observations in it
  double squared_error_ = 0;         ///< of observations, weighted
  double num_residuals_ = 0;         ///< sum of their weights
  Vector gradient_ = Vector::Zero();
};

double
PoseProblem::cost(const PoseState& state) const
{
  double sum = 0;
  for (std::size_t k = 0; k < observations_.size(); ++k)
    sum += observations_[k].cost(blocks(k, state).data(), options_.loss_scale);
  const double* poses[] = {world_.values, state.pose.values};
  Vector6d residual;
  dense_.linearise(poses, residual.data(), nullptr);
  sum += residual.squaredNorm();
  if (depth_error_moves_)
    sum += (state.depth_error / options_.depth_error_deviation).squaredNorm();
  return sum / 2;
}

void
PoseProblem::build(const PoseState& state, double damping)
{
  damping_ = damping;
  observed_.setZero();
  gradient_.setZero();
  squared_error_ = num_residuals_ = 0;
  const double limit = options_.loss_scale * options_.loss_scale;
  for (std::size_t k = 0; k < observations_.size(); ++k) {
    ObservationRows rows =
        observations_[k].linearise(blocks(k, state).data(), options_.loss_scale, false);
    if (!depth_error_moves_)
      rows.by_frame.rightCols<3>().setZero();
    observed_ += rows.by_frame.transpose() * rows.by_frame;
    gradient_ += rows.by_frame.transpose() * rows.residual;
    // The robust weight w of a residual r with w r^2 = q is 1 - q / limit
    const double pixel = rows.residual.head<2>().squaredNorm(),
                 depth = std::pow(rows.residual[2], 2);
    squared_error_ += pixel + depth;
    num_residuals_ += 2 * (1 - pixel / limit) + (observations_[k].depth ? 1 - depth / limit : 0);
  }
  hessian_ = observed_;
  const double* poses[] = {world_.values, state.pose.values};
  Vector6d residual;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> by_motion;
  double* jacobians[] = {nullptr, by_motion.data()};
  dense_.linearise(poses, residual.data(), jacobians);
  hessian_.topLeftCorner<6, 6>() += by_motion.transpose() * by_motion;
  gradient_.head<6>() += by_motion.transpose() * residual;
  // A depth error that is held has no part in any term.
  const double prior = std::pow(options_.depth_error_deviation, -2);
  hessian_.diagonal().tail<3>().array() += depth_error_moves_ ? prior : 1;
  if (depth_error_moves_)
    gradient_.tail<3>() += prior * state.depth_error;
}

Matrix
PoseProblem::information() const
{
  if (num_residuals_ < MIN_RESIDUALS)
    return hessian_;
  // Six residuals' worth went into the pose.
  const double variance = std::max(LEAST_VARIANCE, squared_error_ / (num_residuals_ - 6));
  return hessian_ + (1 / variance - 1) * observed_;
}

std::optional<LeastSquaresStep<PoseState>>
PoseProblem::solve(const PoseState& state) const
{
  const Vector damped = damping_ * hessian_.diagonal().unaryExpr(&dampedPart);
  const Eigen::LLT<Matrix> root(hessian_ + Matrix(damped.asDiagonal()));
  const Vector step = -root.solve(gradient_);
  if (root.info() != Eigen::Success || !step.allFinite())
    return std::nullopt;
  LeastSquaresStep<PoseState> result{state};
  PoseManifold().Plus(state.pose.values, step.data(), result.state.pose.values);
  result.state.depth_error += step.tail<3>();
  result.model_decrease = (damped.dot(step.cwiseAbs2()) - gradient_.dot(step)) / 2;
  const Eigen::Map<const Eigen::Matrix<double, 7, 1>> pose(state.pose.values);
  result.relative_length =
      step.norm() / std::sqrt(pose.squaredNorm() + state.depth_error.squaredNorm());
  return result;
}

} // namespace

double
largestDeviation(const Eigen::Matrix3d& covariance)
{
  const double largest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().maxCoeff();
  return largest >= 0 ? std::sqrt(largest) : std::numeric_limits<double>::infinity();
}

Matrix6d
worldByMotion(const Pose& world_from_camera)
{
  // A motion (w, v) of camera_from_world = (R, t) turns the camera by -R' w and moves it by
  // -R' (v + t x w).
  Matrix6d world_by_motion = Matrix6d::Zero();
  const Eigen::Matrix3d axes = world_from_camera.linear();
  world_by_motion.topLeftCorner<3, 3>() = -axes;
  world_by_motion.bottomRightCorner<3, 3>() = -axes;
  world_by_motion.bottomLeftCorner<3, 3>() =
      -axes * crossMatrix(world_from_camera.inverse().translation());
  return world_by_motion;
}

PoseEstimate
adjustPose(const ImageGraph& graph, const SparseModel& model, std::size_t frame,
           const std::vector<PointObservation>& observations, const DensePoseTerm& dense,
           const BundleAdjustmentOptions& options, bool depth_error, const PoseEstimate& start)
{
  const FrameMeasurement measurement{graph.camera(), model.motion(frame)};
  PoseProblem problem(measurement, graph.features(frame), model, observations, dense, options,
                      depth_error);
  PoseState state{PoseBlock(start.world_from_camera), start.depth_error};
  minimise(problem, MAX_ITERATIONS, FUNCTION_TOLERANCE, state);
  PoseEstimate result{state.pose.worldFromCamera(), state.depth_error};
  const Matrix6d world_by_motion = worldByMotion(result.world_from_camera);
  Matrix information = problem.information();
  information.diagonal().head<6>().array() += PRIOR_INFORMATION;
  const Matrix inverse = information.ldlt().solve(Matrix::Identity());
  result.covariance = world_by_motion * inverse.topLeftCorner<6, 6>() * world_by_motion.transpose();
  return result;
}

} // namespace bundle_icp
