// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "adjustment/adjustment_terms.h"
#include "adjustment/block_cholesky.h"
#include "common/levenberg_marquardt.h"

#include <Eigen/Cholesky>

#include <optional>

namespace bundle_icp {

/** The normal equations of an adjustment, damped, with the points eliminated (the Schur complement
 *  of bundle adjustment): what is left are the frames, six or nine unknowns each, and the
 *  calibration. A problem as minimise() takes it.
 *
 *  Both halves run in parallel and give the same sums for any number of threads: points are
 *  eliminated in fixed chunks, and each block column of the reduced matrix is summed by one thread
 *  alone.
 *  \tparam SIZE unknowns of a frame: 6, or 9 with its depth error */
template <int SIZE>
class ReducedSystem {
public:
  ReducedSystem(const AdjustmentTerms& terms, int num_threads);

  double
  cost(const AdjustmentState& state) const
  {
    return terms_.cost(state, num_threads_);
  }

  void
  build(const AdjustmentState& state, double damping);

  std::optional<LeastSquaresStep<AdjustmentState>>
  solve(const AdjustmentState& state);

  /** Covariance of the calibration that is adjusted, with everything else unknown. */
  Eigen::MatrixXd
  calibrationCovariance();

  /** Covariance of each moving frame's motion, with everything else unknown; of a pose that does
   *  not move it is 0. */
  std::vector<Matrix6d>
  poseCovariances();

private:
  using Block = PaddedBlock<SIZE>;
  using Square = Eigen::Matrix<double, SIZE, SIZE>;
  using Columns = Eigen::Matrix<double, Block::RowsAtCompileTime, 3>;
  using Matrix3X = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /** What phase one leaves of an observation by a frame that moves. */
  struct ObservationTerms {
    Eigen::Matrix<double, 3, SIZE> by_frame;
    Eigen::Vector3d residual;
  };

  /** ... and of a point: (by_point' by_point, damped)^-1 = L L'. */
  struct PointTerms {
    Eigen::Matrix3d root; ///< L
    Eigen::Vector3d gradient;
    Eigen::Vector3d reduced_gradient; ///< L' gradient
    Eigen::Vector3d damping;
  };

  /** Sums over a chunk of points. */
  struct CalibrationTerms {
    Eigen::MatrixXd matrix;
    Eigen::VectorXd diagonal, gradient, reduced_gradient;
  };

  void
  eliminatePoints(std::size_t chunk);
  /** `by_point` is working memory. */
  void
  eliminatePoint(std::size_t p, std::vector<Eigen::Matrix3d>& by_point, CalibrationTerms& sums);
  void
  sumColumn(std::size_t frame);
  void
  addPairs(const AdjustmentState& state);
  void
  addPriors(const AdjustmentState& state);
  void
  addDamping();
  bool
  factorise();
  std::pair<double, double>
  substituteBack(std::size_t chunk, const Eigen::VectorXd& step, AdjustmentState& state) const;

  std::size_t
  numFrames() const
  {
    return terms_.num_moving;
  }
  Eigen::Index
  numCalibrated() const
  {
    return Eigen::Index(terms_.calibrated.size());
  }
  Eigen::Index
  size() const
  {
    return SIZE * Eigen::Index(numFrames()) + numCalibrated();
  }
  const AdjustmentTerms& terms_;
  const int num_threads_;
  const AdjustmentState* state_ = nullptr; ///< while it is built
  double damping_ = 0;
  const std::vector<std::vector<std::size_t>> observations_of_; ///< by frame that moves
  const BlockStructure structure_;                              ///< of the frames' matrix
  // Phase one
  std::vector<ObservationTerms> observations_;
  std::vector<Columns> eliminated_;      ///< by observation: by_frame' by_point L
  std::vector<Matrix3X> by_calibration_; ///< by observation
  std::vector<PointTerms> points_;
  std::vector<Matrix3X> points_by_calibration_; ///< (by_calibration' by_point L)'
  std::vector<CalibrationTerms> calibration_of_chunk_;
  // Phase two
  std::vector<Block> blocks_;
  std::vector<Eigen::MatrixXd> calibration_by_frame_;
  Eigen::MatrixXd calibration_;
  Eigen::VectorXd diagonal_, gradient_, reduced_gradient_;
  // The frames' matrix is factorised, and eliminated from what the calibration adds to it.
  BlockCholesky<SIZE> frames_;
  Eigen::MatrixXd solved_;             ///< frames' inverse times [by calibration | gradient]
  Eigen::LLT<Eigen::MatrixXd> border_; ///< what is left for the calibration
};

} // namespace bundle_icp
