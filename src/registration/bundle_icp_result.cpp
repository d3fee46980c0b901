// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/bundle_icp_result.h>

#include "common/concatenate.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <cmath>
#include <limits>

namespace bundle_icp {

const char*
toString(BundleICPStatus status)
{
  switch (status) {
  case BundleICPStatus::NOT_RUN:
    return "NOT_RUN";
  case BundleICPStatus::CONVERGED:
    return "CONVERGED";
  case BundleICPStatus::MAX_ITERATIONS:
    return "MAX_ITERATIONS";
  case BundleICPStatus::TOO_FEW_CORRESPONDENCES:
    return "TOO_FEW_CORRESPONDENCES";
  case BundleICPStatus::NO_OVERLAP:
    return "NO_OVERLAP";
  case BundleICPStatus::LOW_OVERLAP:
    return "LOW_OVERLAP";
  case BundleICPStatus::REFINEMENT_REJECTED:
    return "REFINEMENT_REJECTED";
  case BundleICPStatus::INVALID_INPUT:
    return "INVALID_INPUT";
  }
  return "";
}

Matrix6d
BundleICPResult::covariance() const
{
  constexpr double LEAST_SHARE = 1e-4; // of a coordinate's square that an open motion moves
  constexpr double INFINITE = std::numeric_limits<double>::infinity();
  const auto open = information.isZero(0) ? 6 : Eigen::Index(degenerate_directions.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic> directions(6, open);
  if (open == 6)
    directions.setIdentity();
  else
    for (Eigen::Index k = 0; k < open; ++k)
      directions.col(k) = degenerate_directions[std::size_t(k)];
  Matrix6d basis = Matrix6d::Identity(); // the open directions first
  if (open > 0)
    basis = directions.householderQr().householderQ() * Matrix6d::Identity();
  const Eigen::MatrixXd held = basis.rightCols(6 - open);
  Matrix6d result = Matrix6d::Zero();
  if (open < 6)
    result = held * (held.transpose() * information * held).ldlt().solve(held.transpose().eval());
  const Matrix6d share = basis.leftCols(open) * basis.leftCols(open).transpose();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      if (std::abs(share(i, j)) > LEAST_SHARE)
        result(i, j) = std::copysign(INFINITE, share(i, j));
  return result;
}

std::string
BundleICPResult::summary() const
{
  return concatenate(toString(status), ": ", inliers, " inliers, overlap ", overlap, ", distance ",
                     rmse, projective ? " m" : "", ", ", iterations, " iterations");
}

} // namespace bundle_icp
