// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "sparse/adjustment_terms.h"

#include <Eigen/CholmodSupport>

#include <memory>
#include <optional>

namespace bundle_icp {

/** A step of an adjustment. */
struct AdjustmentStep {
  AdjustmentState state;         ///< after the step
  double model_decrease = 0;     ///< of the cost, if residuals were linear
  double relative_length = 0;    ///< of the step, over that of the unknowns
};

/** The normal equations of an adjustment, damped, with the points eliminated (the Schur complement
 *  of bundle adjustment): what is left are the images, six or nine unknowns each, and the
 *  calibration.
 *
 *  Both halves run in parallel and give the same sums for any number of threads: points are eliminated
 *  in fixed chunks, and each block column of the reduced matrix is summed by one thread alone.
 *  \tparam SIZE unknowns of an image: 6, or 9 with its depth error */
template <int SIZE>
class ReducedSystem {
public:
  ReducedSystem(const AdjustmentTerms& terms, int num_threads);

  /** Linearises at `state`; `damping` times the diagonal is added to it. */
  void
  build(const AdjustmentState& state, double damping);

  /** Unset when the matrix is not positive definite. */
  std::optional<AdjustmentStep>
  solve(const AdjustmentState& state);

  /** Covariance of the calibration that is adjusted, with everything else unknown. */
  Eigen::MatrixXd
  calibrationCovariance();

private:
  /** Rows in memory: whole vectors of four, the last rows unused. */
  static constexpr int STRIDE = (SIZE + 3) / 4 * 4;
  using Block = Eigen::Matrix<double, STRIDE, SIZE>;
  using Square = Eigen::Matrix<double, SIZE, SIZE>;
  using Columns = Eigen::Matrix<double, STRIDE, 3>;
  using Matrix3X = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /** What phase one leaves of an observation by an image that moves. */
  struct ObservationTerms {
    Eigen::Matrix<double, 3, SIZE> by_image;
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
  findStructure();
  void
  eliminatePoints(std::size_t chunk);
  void
  sumColumn(std::size_t image);
  void
  addPairs(const AdjustmentState& state);
  void
  addPriors(const AdjustmentState& state);
  void
  fillMatrix();
  bool
  factorise();
  Eigen::MatrixXd
  solveFor(const Eigen::MatrixXd& right) const;
  std::pair<double, double>
  substituteBack(std::size_t chunk, const Eigen::VectorXd& step, AdjustmentState& state) const;

  std::size_t
  numImages() const
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
    return SIZE * Eigen::Index(numImages()) + numCalibrated();
  }
  Block&
  block(int row, int column);

  const AdjustmentTerms& terms_;
  const int num_threads_;
  const AdjustmentState* state_ = nullptr; ///< while it is built
  double damping_ = 0;
  // Structure: block column c holds rows_[k] for first_row_[c] <= k < first_row_[c + 1], ascending
  // from the diagonal on.
  std::vector<std::size_t> first_row_;
  std::vector<int> rows_;
  std::vector<std::vector<std::size_t>> observations_of_; ///< by image that moves
  // Phase one
  std::vector<ObservationTerms> observations_;
  std::vector<Columns> eliminated_; ///< by observation: by_image' by_point L
  std::vector<Matrix3X> by_calibration_; ///< by observation
  std::vector<PointTerms> points_;
  std::vector<Matrix3X> points_by_calibration_; ///< (by_calibration' by_point L)'
  std::vector<CalibrationTerms> calibration_of_chunk_;
  // Phase two
  std::vector<Block> blocks_;
  std::vector<Eigen::MatrixXd> calibration_by_image_;
  Eigen::MatrixXd calibration_;
  Eigen::VectorXd diagonal_, gradient_, reduced_gradient_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::LLT<Eigen::MatrixXd> dense_;
  std::unique_ptr<Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>>> sparse_;
};

} // namespace bundle_icp
