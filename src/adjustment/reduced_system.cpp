// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/reduced_system.h"

#include "adjustment/shared_blocks.h"
#include "common/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {

template <int SIZE>
ReducedSystem<SIZE>::ReducedSystem(const AdjustmentTerms& terms, int num_threads)
: terms_(terms), num_threads_(num_threads), observations_of_(observationsOfFrames(terms)),
  structure_(sharedBlocks(terms, observations_of_, num_threads)),
  observations_(terms.observations.size()), eliminated_(terms.observations.size(), Columns::Zero()),
  points_(terms.points.size()), calibration_of_chunk_(terms.numChunks()),
  blocks_(structure_.rows.size()), calibration_by_frame_(terms.num_moving), frames_(structure_)
{
  if (numCalibrated() > 0) {
    by_calibration_.resize(terms.observations.size());
    points_by_calibration_.resize(terms.points.size());
  }
}

template <int SIZE>
void
ReducedSystem<SIZE>::build(const AdjustmentState& state, double damping)
{
  state_ = &state;
  damping_ = damping;
  parallelFor(terms_.numChunks(), num_threads_, {},
              [this](std::size_t chunk) { eliminatePoints(chunk); });
  diagonal_.setZero(size());
  gradient_.setZero(size());
  reduced_gradient_.setZero(size());
  parallelFor(numFrames(), num_threads_, {}, [this](std::size_t frame) { sumColumn(frame); });
  const Eigen::Index m = numCalibrated();
  calibration_.setZero(m, m);
  for (const CalibrationTerms& chunk : calibration_of_chunk_) {
    calibration_ += chunk.matrix;
    diagonal_.tail(m) += chunk.diagonal;
    gradient_.tail(m) += chunk.gradient;
    reduced_gradient_.tail(m) += chunk.reduced_gradient;
  }
  addPairs(state);
  addPriors(state);
  addDamping();
}

/** Phase one: normal equations of each point, and what its elimination takes from the rest. */
template <int SIZE>
void
ReducedSystem<SIZE>::eliminatePoints(std::size_t chunk)
{
  const Eigen::Index m = numCalibrated();
  CalibrationTerms& sums = calibration_of_chunk_[chunk];
  sums.matrix.setZero(m, m);
  sums.diagonal.setZero(m);
  sums.gradient.setZero(m);
  sums.reduced_gradient.setZero(m);
  std::vector<Eigen::Matrix3d> by_point;
  const auto [begin, end] = terms_.pointsOf(chunk);
  for (std::size_t p = begin; p < end; ++p)
    eliminatePoint(p, by_point, sums);
  sums.reduced_gradient += sums.gradient;
}

// The products are lazy since Eigen would treat matrices of so few calibrated columns as large.
template <int SIZE>
void
ReducedSystem<SIZE>::eliminatePoint(std::size_t p, std::vector<Eigen::Matrix3d>& by_point,
                                    CalibrationTerms& sums)
{
  const Eigen::Index m = numCalibrated();
  const std::size_t first = terms_.first_observation[p], last = terms_.first_observation[p + 1];
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Matrix3X by_calibration = Matrix3X::Zero(3, m);
  by_point.clear();
  for (std::size_t k = first; k < last; ++k) {
    const ObservationRows rows = terms_.linearise(terms_.observations[k], *state_);
    by_point.push_back(rows.by_point);
    hessian += rows.by_point.transpose() * rows.by_point;
    gradient += rows.by_point.transpose() * rows.residual;
    observations_[k].by_frame = rows.by_frame.template leftCols<SIZE>();
    observations_[k].residual = rows.residual;
    if (m == 0)
      continue;
    Matrix3X& columns = by_calibration_[k];
    columns.resize(3, m);
    for (Eigen::Index i = 0; i < m; ++i)
      columns.col(i) = rows.by_calibration.col(terms_.calibrated[std::size_t(i)]);
    by_calibration += rows.by_point.transpose().lazyProduct(columns);
    sums.matrix += columns.transpose().lazyProduct(columns);
    sums.diagonal += columns.colwise().squaredNorm().transpose();
    sums.gradient += columns.transpose().lazyProduct(rows.residual);
  }
  PointTerms& point = points_[p];
  point.damping = damping_ * hessian.diagonal().unaryExpr(&dampedPart);
  hessian.diagonal() += point.damping;
  point.root = hessian.llt().matrixL().solve(Eigen::Matrix3d::Identity()).transpose();
  point.gradient = gradient;
  point.reduced_gradient = point.root.transpose() * gradient;
  for (std::size_t k = first; k < last; ++k)
    eliminated_[k].template topRows<SIZE>() =
        observations_[k].by_frame.transpose() * (by_point[k - first] * point.root);
  if (m == 0)
    return;
  points_by_calibration_[p] = point.root.transpose().lazyProduct(by_calibration);
  sums.matrix -= points_by_calibration_[p].transpose().lazyProduct(points_by_calibration_[p]);
  sums.reduced_gradient -=
      points_by_calibration_[p].transpose().lazyProduct(point.reduced_gradient);
}

/** Phase two: one block column of the reduced matrix. */
template <int SIZE>
void
ReducedSystem<SIZE>::sumColumn(std::size_t frame)
{
  std::vector<double*> block_of(numFrames(), nullptr);
  for (std::size_t k = structure_.first[frame]; k < structure_.first[frame + 1]; ++k) {
    blocks_[k].setZero();
    block_of[std::size_t(structure_.rows[k])] = blocks_[k].data();
  }
  Square own = Square::Zero();
  Eigen::Matrix<double, SIZE, 1> gradient = Eigen::Matrix<double, SIZE, 1>::Zero(),
                                 reduced = gradient;
  Eigen::MatrixXd& by_calibration = calibration_by_frame_[frame];
  by_calibration.setZero(numCalibrated(), SIZE);
  std::vector<const double*> factors;
  std::vector<double*> targets;
  for (const std::size_t k : observations_of_[frame]) {
    const ObservationTerms& o = observations_[k];
    const Columns& eliminated = eliminated_[k];
    const std::size_t p = std::size_t(terms_.observations[k].point);
    own += o.by_frame.transpose() * o.by_frame;
    gradient += o.by_frame.transpose() * o.residual;
    reduced -= eliminated.template topRows<SIZE>() * points_[p].reduced_gradient;
    factors.clear();
    targets.clear();
    for (std::size_t j = terms_.first_observation[p]; j < terms_.first_observation[p + 1]; ++j) {
      const std::size_t other = std::size_t(terms_.observations[j].frame);
      if (other < frame || other >= numFrames())
        continue;
      factors.push_back(eliminated_[j].data());
      targets.push_back(block_of[other]);
    }
    subtractProducts<SIZE, 3>(eliminated.data(), factors.data(), targets.data(), factors.size());
    if (numCalibrated() > 0)
      by_calibration += by_calibration_[k].transpose().lazyProduct(o.by_frame) -
                        points_by_calibration_[p].transpose().lazyProduct(
                            eliminated.template topRows<SIZE>().transpose());
  }
  blocks_[structure_.first[frame]].template topRows<SIZE>() += own;
  const Eigen::Index at = SIZE * Eigen::Index(frame);
  diagonal_.segment<SIZE>(at) = own.diagonal();
  gradient_.segment<SIZE>(at) = gradient;
  reduced_gradient_.segment<SIZE>(at) = gradient + reduced;
}

template <int SIZE>
void
ReducedSystem<SIZE>::addPairs(const AdjustmentState& state)
{
  for (const AdjustedPair& pair : terms_.pairs) {
    const int frames[] = {pair.first, pair.second};
    const double* parameters[] = {state.poses[std::size_t(pair.first)].values,
                                  state.poses[std::size_t(pair.second)].values};
    Vector6d residual;
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> by_pose[2];
    double* jacobians[] = {by_pose[0].data(), by_pose[1].data()};
    pair.residual->linearise(parameters, residual.data(), jacobians);
    const auto moves = [&](int k) { return terms_.frames[std::size_t(frames[k])].pose_moves; };
    for (int k = 0; k < 2; ++k) {
      if (!moves(k))
        continue;
      const Matrix6d hessian = by_pose[k].transpose() * by_pose[k];
      const Vector6d gradient = by_pose[k].transpose() * residual;
      const Eigen::Index at = SIZE * frames[k];
      blocks_[structure_.find(frames[k], frames[k])].template topLeftCorner<6, 6>() += hessian;
      diagonal_.segment<6>(at) += hessian.diagonal();
      gradient_.segment<6>(at) += gradient;
      reduced_gradient_.segment<6>(at) += gradient;
    }
    if (!moves(0) || !moves(1))
      continue;
    const int row = pair.first > pair.second ? 0 : 1;
    blocks_[structure_.find(frames[row], frames[1 - row])].template topLeftCorner<6, 6>() +=
        by_pose[row].transpose() * by_pose[1 - row];
  }
}

/** Priors; and unknowns that a frame lacks, which stay where they are. */
template <int SIZE>
void
ReducedSystem<SIZE>::addPriors(const AdjustmentState& state)
{
  const auto add = [this](Eigen::Index k, double& diagonal, double value, double deviation) {
    const double weight = 1 / (deviation * deviation);
    diagonal += weight;
    diagonal_[k] += weight;
    gradient_[k] += weight * value;
    reduced_gradient_[k] += weight * value;
  };
  for (std::size_t i = 0; i < numFrames(); ++i) {
    Block& own = blocks_[structure_.first[i]];
    const Eigen::Index at = SIZE * Eigen::Index(i);
    for (int k = 6; k < SIZE; ++k)
      add(at + k, own(k, k), state.depth_errors[i][k - 6], terms_.depthErrorDeviation());
    if (!terms_.frames[i].pose_moves)
      own.template topLeftCorner<6, 6>().diagonal().setOnes();
  }
  for (Eigen::Index k = 0; k < numCalibrated(); ++k) {
    const int parameter = terms_.calibrated[std::size_t(k)];
    add(size() - numCalibrated() + k, calibration_(k, k), state.calibration[parameter],
        calibrationPrior()[parameter]);
  }
}

template <int SIZE>
void
ReducedSystem<SIZE>::addDamping()
{
  for (std::size_t i = 0; i < numFrames(); ++i)
    for (int k = 0; k < SIZE; ++k)
      blocks_[structure_.first[i]](k, k) +=
          damping_ * dampedPart(diagonal_[SIZE * Eigen::Index(i) + k]);
  for (Eigen::Index k = 0; k < numCalibrated(); ++k)
    calibration_(k, k) += damping_ * dampedPart(diagonal_[size() - numCalibrated() + k]);
}

template <int SIZE>
bool
ReducedSystem<SIZE>::factorise()
{
  if (!frames_.factorise(blocks_))
    return false;
  const Eigen::Index m = numCalibrated(), n = size() - m;
  Eigen::MatrixXd right(n, m + 1);
  for (std::size_t i = 0; m > 0 && i < numFrames(); ++i)
    right.block(SIZE * Eigen::Index(i), 0, SIZE, m) = calibration_by_frame_[i].transpose();
  right.col(m) = reduced_gradient_.head(n);
  solved_ = frames_.solve(right);
  border_.compute(calibration_ - right.leftCols(m).transpose() * solved_.leftCols(m));
  return border_.info() == Eigen::Success;
}

template <int SIZE>
std::optional<LeastSquaresStep<AdjustmentState>>
ReducedSystem<SIZE>::solve(const AdjustmentState& state)
{
  if (!factorise())
    return std::nullopt;
  const Eigen::Index m = numCalibrated(), n = size() - m;
  Eigen::VectorXd step(size());
  step.tail(m) = reduced_gradient_.tail(m);
  for (std::size_t i = 0; m > 0 && i < numFrames(); ++i)
    step.tail(m) -= calibration_by_frame_[i] * solved_.col(m).segment<SIZE>(SIZE * Eigen::Index(i));
  step.tail(m) = -border_.solve(step.tail(m));
  step.head(n) = -solved_.col(m) - solved_.leftCols(m) * step.tail(m);
  if (!step.allFinite())
    return std::nullopt;
  LeastSquaresStep<AdjustmentState> result{state};
  // The linear model falls by -(g - D step)' step / 2, since (H + D) step = -g.
  result.model_decrease = -gradient_.dot(step) / 2;
  for (Eigen::Index k = 0; k < size(); ++k)
    result.model_decrease += damping_ * dampedPart(diagonal_[k]) * step[k] * step[k] / 2;
  std::vector<std::pair<double, double>> of_chunk(terms_.numChunks());
  parallelFor(terms_.numChunks(), num_threads_, {}, [&](std::size_t chunk) {
    of_chunk[chunk] = substituteBack(chunk, step, result.state);
  });
  double squared_step = step.squaredNorm(), squared_length = state.calibration.squaredNorm();
  for (const auto& [decrease, squared] : of_chunk) {
    result.model_decrease += decrease;
    squared_step += squared;
  }
  for (const Eigen::Vector3d& point : state.points)
    squared_length += point.squaredNorm();
  const PoseManifold manifold;
  for (std::size_t i = 0; i < numFrames(); ++i) {
    const Eigen::Matrix<double, SIZE, 1> moved = step.segment<SIZE>(SIZE * Eigen::Index(i));
    if (terms_.frames[i].pose_moves)
      manifold.Plus(state.poses[i].values, moved.data(), result.state.poses[i].values);
    if constexpr (SIZE > 6)
      result.state.depth_errors[i] += moved.template tail<3>();
    squared_length +=
        Eigen::Map<const Eigen::Matrix<double, 7, 1>>(state.poses[i].values).squaredNorm();
  }
  for (Eigen::Index k = 0; k < numCalibrated(); ++k)
    result.state.calibration[terms_.calibrated[std::size_t(k)]] +=
        step[size() - numCalibrated() + k];
  result.relative_length = std::sqrt(squared_step / squared_length);
  return result;
}

/** Steps of the points of a chunk. \return their part of the model's decrease, and their squared
 *  length */
template <int SIZE>
std::pair<double, double>
ReducedSystem<SIZE>::substituteBack(std::size_t chunk, const Eigen::VectorXd& step,
                                    AdjustmentState& state) const
{
  double decrease = 0, squared = 0;
  const auto [begin, end] = terms_.pointsOf(chunk);
  for (std::size_t p = begin; p < end; ++p) {
    const PointTerms& point = points_[p];
    Eigen::Vector3d right = point.reduced_gradient;
    for (std::size_t k = terms_.first_observation[p]; k < terms_.first_observation[p + 1]; ++k)
      if (const int frame = terms_.observations[k].frame; frame < int(numFrames()))
        right +=
            eliminated_[k].template topRows<SIZE>().transpose() * step.segment<SIZE>(SIZE * frame);
    if (numCalibrated() > 0)
      right += points_by_calibration_[p] * step.tail(numCalibrated());
    const Eigen::Vector3d moved = -(point.root * right);
    state.points[p] += moved;
    decrease += -point.gradient.dot(moved) / 2 + point.damping.dot(moved.cwiseAbs2()) / 2;
    squared += moved.squaredNorm();
  }
  return {decrease, squared};
}

template <int SIZE>
Eigen::MatrixXd
ReducedSystem<SIZE>::calibrationCovariance()
{
  const Eigen::Index m = numCalibrated();
  if (!factorise())
    return Eigen::MatrixXd::Constant(m, m, std::numeric_limits<double>::infinity());
  return border_.solve(Eigen::MatrixXd::Identity(m, m));
}

template <int SIZE>
std::vector<Matrix6d>
ReducedSystem<SIZE>::poseCovariances()
{
  std::vector<Matrix6d> result(numFrames(), Matrix6d::Zero());
  const bool is_regular = factorise();
  parallelFor(numFrames(), num_threads_, {}, [&](std::size_t i) {
    if (!terms_.frames[i].pose_moves)
      return;
    if (!is_regular) {
      result[i].diagonal().setConstant(std::numeric_limits<double>::infinity());
      return;
    }
    result[i] = frames_.inverseBlock(i).template topLeftCorner<6, 6>();
    if (numCalibrated() == 0)
      return;
    const Eigen::MatrixXd by_calibration =
        solved_.block(SIZE * Eigen::Index(i), 0, 6, numCalibrated());
    result[i] += by_calibration * border_.solve(by_calibration.transpose());
  });
  return result;
}

template class ReducedSystem<6>;
template class ReducedSystem<9>;

} // namespace bundle_icp
