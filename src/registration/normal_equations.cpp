// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/normal_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {
/** Normalised distance beyond which a correspondence is an outlier. */
constexpr double OUTLIER_SIGMAS = 4;
/** Fewer tiles do not show how errors scatter. */
constexpr double MIN_TILES = 12;
/** Of a measurement, over that which the noise model expects. */
constexpr double LEAST_VARIANCE = 0.25;

/** -H^-1 g along the directions that H holds. */
Vector6d
minimum(const Matrix6d& H, const Vector6d& g)
{
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(H);
  const double smallest = 1e-9 * solver.eigenvalues()[5];
  Vector6d step = Vector6d::Zero();
  for (int k = 0; k < 6; ++k)
    if (solver.eigenvalues()[k] > smallest) {
      const Vector6d direction = solver.eigenvectors().col(k);
      step -= direction * (direction.dot(g) / solver.eigenvalues()[k]);
    }
  return step;
}

} // namespace

VisualSystem
accumulateVisual(const VisualCorrespondences& visual, const Pose& pose,
                 const Eigen::Vector3d& center, double scale)
{
  constexpr double LIMIT = OUTLIER_SIGMAS * OUTLIER_SIGMAS;
  VisualSystem system;
  for (std::size_t i = 0; i < visual.source.size(); ++i) {
    const Eigen::Vector3d p = pose * visual.source[i];
    const Eigen::Vector3d residual = p - visual.target[i];
    const double weight = visual.weights[i] / (scale * scale);
    const double error = weight * residual.squaredNorm();
    system.cost += std::min(LIMIT, error);
    if (error >= LIMIT)
      continue;
    ++system.inliers;
    system.squared_inliers += residual.squaredNorm();
    const double inside = 1 - error / LIMIT;
    Eigen::Matrix<double, 3, 6> J;
    J.leftCols<3>() = -crossMatrix(p - center);
    J.rightCols<3>().setIdentity();
    const double robust = weight * inside * inside;
    system.H += robust * J.transpose() * J;
    system.g += robust * J.transpose() * residual;
  }
  return system;
}

Step
solve(const DenseSystem& dense, double variance_factor, const VisualSystem& visual,
      const Observability& observability)
{
  // In units of length, so that eigenvalues of rotations and translations compare.
  Vector6d unit = Vector6d::Ones();
  unit.head<3>().setConstant(1 / observability.length);
  const auto S = unit.asDiagonal();
  const Matrix6d H = S * (dense.H / variance_factor) * S;
  const double weight = dense.weight / variance_factor;
  const Matrix6d structure = S * (dense.structure / variance_factor) * S;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(observability.misaligned ? H : structure);
  Step step;
  Matrix6d held = Matrix6d::Zero();
  for (int k = 0; k < 6; ++k) {
    const Vector6d direction = eigen.eigenvectors().col(k);
    const double information = eigen.eigenvalues()[k];
    const double limit = observability.max_deviation;
    if (information > observability.min_share * weight && information * limit * limit > 1)
      held += direction * direction.transpose();
    else
      step.degenerate.push_back((S * direction).normalized());
  }
  const Matrix6d dense_H = held * (observability.misaligned ? H : structure) * held;
  const Vector6d dense_g = held * (S * (dense.g / variance_factor));
  step.dense_delta = S * minimum(dense_H, dense_g);
  step.delta = S * minimum(dense_H + S * visual.H * S, dense_g + S * visual.g);
  const Vector6d back = unit.cwiseInverse();
  step.information = back.asDiagonal() * dense_H * back.asDiagonal();
  return step;
}

Matrix6d
robustInformation(const Matrix6d& information, double variance_factor,
                  const std::vector<Vector6d>& gradients, double model_share)
{
  const auto count = static_cast<double>(gradients.size());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  const Eigen::Index held = (eigen.eigenvalues().array() > 1e-9 * eigen.eigenvalues()[5]).count();
  if (count < MIN_TILES || held == 0)
    return information;
  const Eigen::MatrixXd basis = eigen.eigenvectors().rightCols(held);
  const Eigen::MatrixXd H = variance_factor * basis.transpose() * information * basis;
  // No data are as exact as those that agree by chance.
  Eigen::MatrixXd M = (LEAST_VARIANCE + model_share * variance_factor) * H;
  // Six gradients' worth went into the pose.
  for (const Vector6d& gradient : gradients) {
    const Eigen::VectorXd g = basis.transpose() * gradient;
    M += (1 - model_share) * count / (count - 6) * g * g.transpose();
  }
  const Matrix6d result = basis * (H * M.ldlt().solve(H)) * basis.transpose();
  return 0.5 * (result + result.transpose());
}

} // namespace bundle_icp
