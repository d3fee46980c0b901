// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/reduced_system.h"

#include "common/parallel.h"
#include "common/simd.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace bundle_icp {
namespace {

/** Above so many unknowns a sparse factorisation is faster than a dense one. */
constexpr Eigen::Index MAX_DENSE = 400;

/** As in Ceres: the part of the diagonal that is damped never vanishes, measured where columns are
 *  scaled to about unit length. */
double
dampedPart(double diagonal)
{
  const double scale = 1 + std::sqrt(diagonal);
  return std::max(diagonal, 1e-6 * scale * scale);
}

using simd::Doubles;

/** block -= a b', for a and b of SIZE x 3, all of them with columns of whole vectors. */
template <int SIZE>
BUNDLE_ICP_INLINE void
subtractProduct(const double* a, const double* b, double* block)
{
  constexpr int VECTORS = (SIZE + 3) / 4, STRIDE = 4 * VECTORS;
  Doubles rows[3][VECTORS];
  for (int k = 0; k < 3; ++k)
    for (int v = 0; v < VECTORS; ++v)
      rows[k][v] = simd::load<Doubles>(a + k * STRIDE + 4 * v);
  for (int j = 0; j < SIZE; ++j)
    for (int v = 0; v < VECTORS; ++v) {
      double* const at = block + j * STRIDE + 4 * v;
      const Doubles difference = simd::load<Doubles>(at) - rows[0][v] * b[j] - rows[1][v] * b[STRIDE + j] -
                                 rows[2][v] * b[2 * STRIDE + j];
      std::memcpy(at, &difference, sizeof(difference));
    }
}

/** The blocks of one column that one point has a part in. */
template <int SIZE>
BUNDLE_ICP_INLINE void
subtractProducts(const double* b, const double* const* a, double* const* blocks, std::size_t count)
{
  for (std::size_t k = 0; k < count; ++k)
    subtractProduct<SIZE>(a[k], b, blocks[k]);
}

} // namespace

template <int SIZE>
ReducedSystem<SIZE>::ReducedSystem(const AdjustmentTerms& terms, int num_threads)
: terms_(terms), num_threads_(num_threads)
{
  findStructure();
  observations_.resize(terms.observations.size());
  eliminated_.resize(terms.observations.size(), Columns::Zero());
  points_.resize(terms.points.size());
  calibration_of_chunk_.resize(terms_.numChunks());
  calibration_by_image_.resize(numImages());
  if (numCalibrated() > 0) {
    by_calibration_.resize(terms.observations.size());
    points_by_calibration_.resize(terms.points.size());
  }
}

/** Two images share a block when they see a point together or are a dense pair. */
template <int SIZE>
void
ReducedSystem<SIZE>::findStructure()
{
  observations_of_.resize(numImages());
  for (std::size_t k = 0; k < terms_.observations.size(); ++k)
    if (const std::size_t image = std::size_t(terms_.observations[k].image); image < numImages())
      observations_of_[image].push_back(k);
  std::vector<std::vector<int>> partners(numImages());
  for (const AdjustedPair& pair : terms_.pairs)
    if (std::max(pair.first, pair.second) < int(numImages()))
      partners[std::size_t(std::min(pair.first, pair.second))].push_back(
          std::max(pair.first, pair.second));
  std::vector<std::vector<int>> columns(numImages());
  parallelFor(numImages(), num_threads_, {}, [&](std::size_t c) {
    std::vector<char> shared(numImages(), 0);
    shared[c] = 1;
    for (const int partner : partners[c])
      shared[std::size_t(partner)] = 1;
    for (const std::size_t k : observations_of_[c]) {
      const std::size_t p = std::size_t(terms_.observations[k].point);
      for (std::size_t o = terms_.first_observation[p]; o < terms_.first_observation[p + 1]; ++o)
        if (terms_.observations[o].image < int(numImages()))
          shared[std::size_t(terms_.observations[o].image)] = 1;
    }
    for (std::size_t r = c; r < numImages(); ++r)
      if (shared[r])
        columns[c].push_back(int(r));
  });
  for (const std::vector<int>& column : columns) {
    first_row_.push_back(rows_.size());
    rows_.insert(rows_.end(), column.begin(), column.end());
  }
  first_row_.push_back(rows_.size());
  blocks_.resize(rows_.size());

  std::vector<int> counts;
  for (std::size_t c = 0; c < numImages(); ++c)
    for (int k = 0; k < SIZE; ++k)
      counts.push_back(SIZE * int(columns[c].size()) - k + int(numCalibrated()));
  for (Eigen::Index k = 0; k < numCalibrated(); ++k)
    counts.push_back(int(numCalibrated() - k));
  matrix_.resize(size(), size());
  matrix_.reserve(counts);
  for (std::size_t c = 0; c < numImages(); ++c)
    for (int k = 0; k < SIZE; ++k) {
      const Eigen::Index column = SIZE * Eigen::Index(c) + k;
      for (const int row : columns[c])
        for (int i = row == int(c) ? k : 0; i < SIZE; ++i)
          matrix_.insert(SIZE * row + i, column) = 0;
      for (Eigen::Index i = size() - numCalibrated(); i < size(); ++i)
        matrix_.insert(i, column) = 0;
    }
  for (Eigen::Index column = size() - numCalibrated(); column < size(); ++column)
    for (Eigen::Index i = column; i < size(); ++i)
      matrix_.insert(i, column) = 0;
  matrix_.makeCompressed();
}

template <int SIZE>
typename ReducedSystem<SIZE>::Block&
ReducedSystem<SIZE>::block(int row, int column)
{
  const auto begin = rows_.begin() + std::ptrdiff_t(first_row_[std::size_t(column)]);
  const auto end = rows_.begin() + std::ptrdiff_t(first_row_[std::size_t(column) + 1]);
  return blocks_[std::size_t(std::lower_bound(begin, end, row) - rows_.begin())];
}

template <int SIZE>
void
ReducedSystem<SIZE>::build(const AdjustmentState& state, double damping)
{
  state_ = &state;
  damping_ = damping;
  parallelFor(terms_.numChunks(), num_threads_, {}, [this](std::size_t chunk) { eliminatePoints(chunk); });
  diagonal_.setZero(size());
  gradient_.setZero(size());
  reduced_gradient_.setZero(size());
  parallelFor(numImages(), num_threads_, {}, [this](std::size_t image) { sumColumn(image); });
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
  fillMatrix();
}

// The products are lazy since Eigen would treat matrices of so few calibrated columns as large.
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
  for (std::size_t p = begin; p < end; ++p) {
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
      observations_[k].by_image = rows.by_image.template leftCols<SIZE>();
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
          observations_[k].by_image.transpose() * (by_point[k - first] * point.root);
    if (m == 0)
      continue;
    points_by_calibration_[p] = point.root.transpose().lazyProduct(by_calibration);
    sums.matrix -= points_by_calibration_[p].transpose().lazyProduct(points_by_calibration_[p]);
    sums.reduced_gradient -=
        points_by_calibration_[p].transpose().lazyProduct(point.reduced_gradient);
  }
  sums.reduced_gradient += sums.gradient;
}

/** Phase two: one block column of the reduced matrix. */
template <int SIZE>
void
ReducedSystem<SIZE>::sumColumn(std::size_t image)
{
  std::vector<double*> block_of(numImages(), nullptr);
  for (std::size_t k = first_row_[image]; k < first_row_[image + 1]; ++k) {
    blocks_[k].setZero();
    block_of[std::size_t(rows_[k])] = blocks_[k].data();
  }
  Square own = Square::Zero();
  Eigen::Matrix<double, SIZE, 1> gradient = Eigen::Matrix<double, SIZE, 1>::Zero(), reduced = gradient;
  Eigen::MatrixXd& by_calibration = calibration_by_image_[image];
  by_calibration.setZero(numCalibrated(), SIZE);
  std::vector<const double*> factors;
  std::vector<double*> targets;
  for (const std::size_t k : observations_of_[image]) {
    const ObservationTerms& o = observations_[k];
    const Columns& eliminated = eliminated_[k];
    const std::size_t p = std::size_t(terms_.observations[k].point);
    own += o.by_image.transpose() * o.by_image;
    gradient += o.by_image.transpose() * o.residual;
    reduced -= eliminated.template topRows<SIZE>() * points_[p].reduced_gradient;
    factors.clear();
    targets.clear();
    for (std::size_t j = terms_.first_observation[p]; j < terms_.first_observation[p + 1]; ++j) {
      const std::size_t other = std::size_t(terms_.observations[j].image);
      if (other < image || other >= numImages())
        continue;
      factors.push_back(eliminated_[j].data());
      targets.push_back(block_of[other]);
    }
    simd::call<subtractProducts<SIZE>>(eliminated.data(), factors.data(), targets.data(),
                                       factors.size());
    if (numCalibrated() > 0)
      by_calibration += by_calibration_[k].transpose().lazyProduct(o.by_image) -
                        points_by_calibration_[p].transpose().lazyProduct(
                            eliminated.template topRows<SIZE>().transpose());
  }
  blocks_[first_row_[image]].template topRows<SIZE>() += own;
  const Eigen::Index at = SIZE * Eigen::Index(image);
  diagonal_.segment<SIZE>(at) = own.diagonal();
  gradient_.segment<SIZE>(at) = gradient;
  reduced_gradient_.segment<SIZE>(at) = gradient + reduced;
}

template <int SIZE>
void
ReducedSystem<SIZE>::addPairs(const AdjustmentState& state)
{
  for (const AdjustedPair& pair : terms_.pairs) {
    const int images[] = {pair.first, pair.second};
    const double* parameters[] = {state.poses[std::size_t(pair.first)].values,
                                  state.poses[std::size_t(pair.second)].values};
    Vector6d residual;
    Eigen::Matrix<double, 6, 7, Eigen::RowMajor> by_pose[2];
    double* jacobians[] = {by_pose[0].data(), by_pose[1].data()};
    pair.residual->Evaluate(parameters, residual.data(), jacobians);
    const auto moves = [&](int k) { return terms_.images[std::size_t(images[k])].pose_moves; };
    for (int k = 0; k < 2; ++k) {
      if (!moves(k))
        continue;
      const Matrix6d jacobian = by_pose[k].template leftCols<6>();
      const Matrix6d hessian = jacobian.transpose() * jacobian;
      const Vector6d gradient = jacobian.transpose() * residual;
      const Eigen::Index at = SIZE * images[k];
      block(images[k], images[k]).template topLeftCorner<6, 6>() += hessian;
      diagonal_.segment<6>(at) += hessian.diagonal();
      gradient_.segment<6>(at) += gradient;
      reduced_gradient_.segment<6>(at) += gradient;
    }
    if (!moves(0) || !moves(1))
      continue;
    const int row = pair.first > pair.second ? 0 : 1;
    block(images[row], images[1 - row]).template topLeftCorner<6, 6>() +=
        by_pose[row].template leftCols<6>().transpose() * by_pose[1 - row].template leftCols<6>();
  }
}

/** Priors; and unknowns that an image lacks, which stay where they are. */
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
  for (std::size_t i = 0; i < numImages(); ++i) {
    Block& own = blocks_[first_row_[i]];
    const Eigen::Index at = SIZE * Eigen::Index(i);
    for (int k = 6; k < SIZE; ++k)
      add(at + k, own(k, k), state.depth_errors[i][k - 6], terms_.depthErrorDeviation());
    if (!terms_.images[i].pose_moves)
      own.template topLeftCorner<6, 6>().diagonal().setOnes();
  }
  for (Eigen::Index k = 0; k < numCalibrated(); ++k) {
    const int parameter = terms_.calibrated[std::size_t(k)];
    add(size() - numCalibrated() + k,
        calibration_(k, k),
        state.calibration[parameter],
        calibrationPrior()[parameter]);
  }
}

template <int SIZE>
void
ReducedSystem<SIZE>::fillMatrix()
{
  double* value = matrix_.valuePtr();
  for (std::size_t c = 0; c < numImages(); ++c)
    for (int k = 0; k < SIZE; ++k) {
      double* const diagonal = value;
      for (std::size_t b = first_row_[c]; b < first_row_[c + 1]; ++b)
        for (int i = b == first_row_[c] ? k : 0; i < SIZE; ++i)
          *value++ = blocks_[b](i, k);
      *diagonal += damping_ * dampedPart(diagonal_[SIZE * Eigen::Index(c) + k]);
      for (Eigen::Index i = 0; i < numCalibrated(); ++i)
        *value++ = calibration_by_image_[c](i, k);
    }
  for (Eigen::Index k = 0; k < numCalibrated(); ++k) {
    double* const diagonal = value;
    for (Eigen::Index i = k; i < numCalibrated(); ++i)
      *value++ = calibration_(i, k);
    *diagonal += damping_ * dampedPart(diagonal_[size() - numCalibrated() + k]);
  }
}

template <int SIZE>
bool
ReducedSystem<SIZE>::factorise()
{
  if (size() <= MAX_DENSE) {
    dense_.compute(Eigen::MatrixXd(matrix_));
    return dense_.info() == Eigen::Success;
  }
  if (!sparse_) {
    sparse_ = std::make_unique<Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>>>();
    sparse_->cholmod().print = 0; // a matrix that is not positive definite is no error here
    sparse_->analyzePattern(matrix_);
  }
  sparse_->factorize(matrix_);
  return sparse_->info() == Eigen::Success;
}

template <int SIZE>
Eigen::MatrixXd
ReducedSystem<SIZE>::solveFor(const Eigen::MatrixXd& right) const
{
  if (size() <= MAX_DENSE)
    return dense_.solve(right);
  return sparse_->solve(right);
}

template <int SIZE>
std::optional<AdjustmentStep>
ReducedSystem<SIZE>::solve(const AdjustmentState& state)
{
  if (!factorise())
    return std::nullopt;
  const Eigen::VectorXd step = -solveFor(reduced_gradient_);
  if (!step.allFinite())
    return std::nullopt;
  AdjustmentStep result{state};
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
  for (std::size_t i = 0; i < numImages(); ++i) {
    const Eigen::Matrix<double, SIZE, 1> moved = step.segment<SIZE>(SIZE * Eigen::Index(i));
    if (terms_.images[i].pose_moves)
      manifold.Plus(state.poses[i].values, moved.data(), result.state.poses[i].values);
    if constexpr (SIZE > 6)
      result.state.depth_errors[i] += moved.template tail<3>();
    squared_length += Eigen::Map<const Eigen::Matrix<double, 7, 1>>(state.poses[i].values).squaredNorm();
  }
  for (Eigen::Index k = 0; k < numCalibrated(); ++k)
    result.state.calibration[terms_.calibrated[std::size_t(k)]] += step[size() - numCalibrated() + k];
  result.relative_length = std::sqrt(squared_step / squared_length);
  return result;
}

/** Steps of the points of a chunk. \return their part of the model's decrease, and their squared
 *  length */
template <int SIZE>
std::pair<double, double>
ReducedSystem<SIZE>::substituteBack(std::size_t chunk,
                                    const Eigen::VectorXd& step,
                                    AdjustmentState& state) const
{
  double decrease = 0, squared = 0;
  const auto [begin, end] = terms_.pointsOf(chunk);
  for (std::size_t p = begin; p < end; ++p) {
    const PointTerms& point = points_[p];
    Eigen::Vector3d right = point.reduced_gradient;
    for (std::size_t k = terms_.first_observation[p]; k < terms_.first_observation[p + 1]; ++k)
      if (const int image = terms_.observations[k].image; image < int(numImages()))
        right += eliminated_[k].template topRows<SIZE>().transpose() *
                 step.segment<SIZE>(SIZE * image);
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
  return solveFor(Eigen::MatrixXd::Identity(size(), size()).rightCols(m)).bottomRows(m);
}

template class ReducedSystem<6>;
template class ReducedSystem<9>;

} // namespace bundle_icp
