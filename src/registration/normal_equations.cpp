// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "normal_equations.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {
/** Normalised distance beyond which a correspondence is an outlier. */
constexpr double OUTLIER_SIGMAS = 4;
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
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(
      observability.misaligned ? H : structure);
  Step step;
  Matrix6d held = Matrix6d::Zero();
  for (int k = 0; k < 6; ++k) {
    const Vector6d direction = eigen.eigenvectors().col(k);
    const double information = eigen.eigenvalues()[k];
    const double limit = observability.max_deviation;
    if (information > observability.min_share * weight &&
        information * limit * limit > 1)
      held += direction * direction.transpose();
    else
      step.degenerate.push_back((S * direction).normalized());
  }
  const Matrix6d total = held * H * held + S * visual.H * S;
  const Vector6d gradient = held * (S * (dense.g / variance_factor)) + S * visual.g;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(total);
  const double smallest = 1e-9 * solver.eigenvalues()[5];
  for (int k = 0; k < 6; ++k)
    if (solver.eigenvalues()[k] > smallest) {
      const Vector6d direction = solver.eigenvectors().col(k);
      step.delta -= S * direction * (direction.dot(gradient) / solver.eigenvalues()[k]);
    }
  const Vector6d back = unit.cwiseInverse();
  step.information = back.asDiagonal() * total * back.asDiagonal();
  return step;
}

} // namespace bundle_icp
