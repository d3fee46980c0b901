// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "adjustment/adjustment_terms.h"
#include "common/levenberg_marquardt.h"

#include <Eigen/Dense>

namespace bundle_icp::test {

/** The equations of an adjustment without any structure: one matrix that holds all unknowns,
 *  frames first, then the calibration, then the points. What ReducedSystem has to agree with.
 *  \tparam SIZE unknowns of a frame: 6, or 9 with its depth error */
template <int SIZE>
struct DenseSystem {
  Eigen::Index num_frames, num_calibrated;
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;
  Eigen::VectorXd damping; ///< what is added to the diagonal of the normal equations

  DenseSystem(const AdjustmentTerms& terms, const AdjustmentState& state, double factor)
  : num_frames(Eigen::Index(terms.num_moving)),
    num_calibrated(Eigen::Index(terms.calibrated.size()))
  {
    const Eigen::Index observed = 3 * Eigen::Index(terms.observations.size());
    const Eigen::Index related = 6 * Eigen::Index(terms.pairs.size());
    jacobian.setZero(observed + related + firstPoint(),
                     firstPoint() + 3 * Eigen::Index(terms.points.size()));
    residual.setZero(jacobian.rows());
    for (std::size_t k = 0; k < terms.observations.size(); ++k)
      addObservation(terms, state, k);
    for (std::size_t k = 0; k < terms.pairs.size(); ++k)
      addPair(terms.pairs[k], terms, state, observed + 6 * Eigen::Index(k));
    addPriors(terms, state, observed + related);
    damping = factor * hessian().diagonal().unaryExpr(&dampedPart);
  }

  Eigen::Index
  firstPoint() const
  {
    return SIZE * num_frames + num_calibrated;
  }

  Eigen::MatrixXd
  hessian() const
  {
    return jacobian.transpose() * jacobian;
  }

  Eigen::VectorXd
  gradient() const
  {
    return jacobian.transpose() * residual;
  }

  Eigen::VectorXd
  step() const
  {
    return -(hessian() + Eigen::MatrixXd(damping.asDiagonal())).ldlt().solve(gradient());
  }

  /** The state after a step. */
  AdjustmentState
  moved(const AdjustmentTerms& terms, const AdjustmentState& state,
        const Eigen::VectorXd& step) const
  {
    AdjustmentState result = state;
    for (Eigen::Index i = 0; i < num_frames; ++i) {
      const Eigen::VectorXd of_image = step.segment<SIZE>(SIZE * i);
      PoseManifold().Plus(state.poses[std::size_t(i)].values, of_image.data(),
                          result.poses[std::size_t(i)].values);
      result.depth_errors[std::size_t(i)].head<SIZE - 6>() += of_image.tail<SIZE - 6>();
    }
    for (Eigen::Index k = 0; k < num_calibrated; ++k)
      result.calibration[terms.calibrated[std::size_t(k)]] += step[SIZE * num_frames + k];
    for (std::size_t p = 0; p < state.points.size(); ++p)
      result.points[p] += step.segment<3>(firstPoint() + 3 * Eigen::Index(p));
    return result;
  }

private:
  void
  addObservation(const AdjustmentTerms& terms, const AdjustmentState& state, std::size_t k)
  {
    const AdjustedObservation& o = terms.observations[k];
    const ObservationRows rows = terms.linearise(o, state);
    const Eigen::Index row = 3 * Eigen::Index(k);
    residual.segment<3>(row) = rows.residual;
    jacobian.block<3, 3>(row, firstPoint() + 3 * o.point) = rows.by_point;
    if (o.frame < num_frames)
      jacobian.block<3, SIZE>(row, SIZE * o.frame) = rows.by_frame.leftCols<SIZE>();
    for (Eigen::Index c = 0; c < num_calibrated; ++c)
      jacobian.block<3, 1>(row, SIZE * num_frames + c) =
          rows.by_calibration.col(terms.calibrated[std::size_t(c)]);
  }

  void
  addPair(const AdjustedPair& pair, const AdjustmentTerms& terms, const AdjustmentState& state,
          Eigen::Index row)
  {
    const int frames[] = {pair.first, pair.second};
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> by_pose[2];
    double* jacobians[] = {by_pose[0].data(), by_pose[1].data()};
    const double* poses[] = {state.poses[std::size_t(pair.first)].values,
                             state.poses[std::size_t(pair.second)].values};
    pair.residual->linearise(poses, &residual[row], jacobians);
    for (int k = 0; k < 2; ++k)
      if (terms.frames[std::size_t(frames[k])].pose_moves)
        jacobian.block<6, 6>(row, SIZE * frames[k]) = by_pose[k];
  }

  /** One row per unknown of a frame and of the calibration: empty where it has no prior. */
  void
  addPriors(const AdjustmentTerms& terms, const AdjustmentState& state, Eigen::Index row)
  {
    const auto add = [&](Eigen::Index unknown, double value, double deviation) {
      jacobian(row + unknown, unknown) = 1 / deviation;
      residual[row + unknown] = value / deviation;
    };
    for (Eigen::Index i = 0; i < num_frames; ++i) {
      for (int k = 6; k < SIZE; ++k)
        add(SIZE * i + k, state.depth_errors[std::size_t(i)][k - 6], terms.depthErrorDeviation());
      for (int k = 0; k < 6 && !terms.frames[std::size_t(i)].pose_moves; ++k)
        add(SIZE * i + k, 0, 1); // it stays
    }
    for (Eigen::Index k = 0; k < num_calibrated; ++k) {
      const int parameter = terms.calibrated[std::size_t(k)];
      add(SIZE * num_frames + k, state.calibration[parameter], calibrationPrior()[parameter]);
    }
  }
};

} // namespace bundle_icp::test
