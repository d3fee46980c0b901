// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/block_cholesky.h"

#include "common/simd.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cstring>

namespace bundle_icp {
namespace {

using simd::Doubles;

template <int SIZE, int INNER>
BUNDLE_ICP_INLINE void
subtractEach(const double* b, const double* const* a, double* const* blocks, std::size_t count)
{
  constexpr int STRIDE = (SIZE + 3) / 4 * 4;
  for (std::size_t n = 0; n < count; ++n)
    for (int v = 0; v < STRIDE; v += 4) {
      Doubles rows[INNER];
      for (int k = 0; k < INNER; ++k)
        rows[k] = simd::load<Doubles>(a[n] + k * STRIDE + v);
      for (int j = 0; j < SIZE; ++j) {
        double* const at = blocks[n] + j * STRIDE + v;
        Doubles difference = simd::load<Doubles>(at);
        for (int k = 0; k < INNER; ++k)
          difference -= rows[k] * b[k * STRIDE + j];
        std::memcpy(at, &difference, sizeof(difference));
      }
    }
}

/** Positions that leave few blocks in the factor. */
std::vector<int>
minimumDegree(const BlockStructure& matrix)
{
  const int n = int(matrix.numColumns());
  std::vector<Eigen::Triplet<double>> entries;
  for (int c = 0; c < n; ++c)
    for (std::size_t k = matrix.first[std::size_t(c)]; k < matrix.first[std::size_t(c) + 1]; ++k)
      entries.emplace_back(matrix.rows[k], c, 1);
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> columns;
  Eigen::AMDOrdering<int>()(pattern, columns);
  std::vector<int> positions(matrix.numColumns());
  for (int k = 0; k < n; ++k)
    positions[std::size_t(columns.indices()[k])] = k;
  return positions;
}

/** Blocks of the factor: the blocks of the matrix, and those that each column passes on to the next
 *  column that it meets. */
BlockStructure
fillIn(const BlockStructure& matrix, const std::vector<int>& positions)
{
  std::vector<std::vector<int>> columns(matrix.numColumns());
  for (std::size_t c = 0; c < columns.size(); ++c)
    for (std::size_t k = matrix.first[c]; k < matrix.first[c + 1]; ++k) {
      const auto [column, row] = std::minmax(positions[c], positions[std::size_t(matrix.rows[k])]);
      columns[std::size_t(column)].push_back(row);
    }
  for (std::vector<int>& column : columns) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    if (column.size() > 1) {
      std::vector<int>& next = columns[std::size_t(column[1])];
      next.insert(next.end(), column.begin() + 1, column.end());
    }
  }
  return BlockStructure(columns);
}

} // namespace

BlockStructure::BlockStructure(const std::vector<std::vector<int>>& columns) : first{0}
{
  for (const std::vector<int>& column : columns) {
    rows.insert(rows.end(), column.begin(), column.end());
    first.push_back(rows.size());
  }
}

std::size_t
BlockStructure::find(int row, int column) const
{
  const auto begin = rows.begin() + std::ptrdiff_t(first[std::size_t(column)]);
  const auto end = rows.begin() + std::ptrdiff_t(first[std::size_t(column) + 1]);
  return std::size_t(std::lower_bound(begin, end, row) - rows.begin());
}

template <int SIZE, int INNER>
void
subtractProducts(const double* b, const double* const* a, double* const* blocks, std::size_t count)
{
  simd::call<subtractEach<SIZE, INNER>>(b, a, blocks, count);
}

template <int SIZE>
BlockCholesky<SIZE>::BlockCholesky(const BlockStructure& matrix)
: position_(minimumDegree(matrix)), structure_(fillIn(matrix, position_)),
  left_of_(matrix.numColumns()), blocks_(structure_.rows.size())
{
  for (std::size_t c = 0; c < matrix.numColumns(); ++c)
    for (std::size_t k = matrix.first[c]; k < matrix.first[c + 1]; ++k) {
      const int column = position_[c], row = position_[std::size_t(matrix.rows[k])];
      targets_.push_back(
          {structure_.find(std::max(row, column), std::min(row, column)), row < column});
    }
  for (std::size_t c = 0; c < structure_.numColumns(); ++c)
    for (std::size_t k = structure_.first[c] + 1; k < structure_.first[c + 1]; ++k)
      left_of_[std::size_t(structure_.rows[k])].emplace_back(k, structure_.first[c + 1]);
}

template <int SIZE>
bool
BlockCholesky<SIZE>::factorise(const std::vector<Block>& blocks)
{
  std::fill(blocks_.begin(), blocks_.end(), Block(Block::Zero()));
  for (std::size_t k = 0; k < targets_.size(); ++k) {
    const auto from = blocks[k].template topRows<SIZE>();
    auto to = blocks_[targets_[k].block].template topRows<SIZE>();
    if (targets_[k].is_transposed)
      to = from.transpose();
    else
      to = from;
  }
  std::vector<double*> block_of(structure_.numColumns(), nullptr);
  for (std::size_t c = 0; c < structure_.numColumns(); ++c)
    if (!factoriseColumn(c, block_of))
      return false;
  return true;
}

/** Subtracts from a column the part that earlier columns explain, and divides by the root of its
 *  diagonal. */
template <int SIZE>
bool
BlockCholesky<SIZE>::factoriseColumn(std::size_t column, std::vector<double*>& block_of)
{
  const std::size_t begin = structure_.first[column], end = structure_.first[column + 1];
  for (std::size_t k = begin; k < end; ++k)
    block_of[std::size_t(structure_.rows[k])] = blocks_[k].data();
  std::vector<const double*> factors;
  std::vector<double*> targets;
  for (const auto& [first, last] : left_of_[column]) {
    factors.clear();
    targets.clear();
    for (std::size_t k = first; k < last; ++k) {
      factors.push_back(blocks_[k].data());
      targets.push_back(block_of[std::size_t(structure_.rows[k])]);
    }
    subtractProducts<SIZE, SIZE>(blocks_[first].data(), factors.data(), targets.data(),
                                 factors.size());
  }
  using Square = Eigen::Matrix<double, SIZE, SIZE>;
  const Eigen::LLT<Square> root(blocks_[begin].template topRows<SIZE>());
  if (root.info() != Eigen::Success)
    return false;
  blocks_[begin].template topRows<SIZE>() = root.matrixL().toDenseMatrix();
  const Square inverse = root.matrixL().solve(Square::Identity());
  for (std::size_t k = begin + 1; k < end; ++k)
    blocks_[k].template topRows<SIZE>() = blocks_[k].template topRows<SIZE>() * inverse.transpose();
  return true;
}

template <int SIZE>
Eigen::MatrixXd
BlockCholesky<SIZE>::solve(const Eigen::MatrixXd& right) const
{
  Eigen::MatrixXd x(right.rows(), right.cols());
  for (std::size_t c = 0; c < position_.size(); ++c)
    x.middleRows<SIZE>(SIZE * position_[c]) = right.middleRows<SIZE>(SIZE * Eigen::Index(c));
  const auto at = [&x](Eigen::Index row) { return x.middleRows<SIZE>(SIZE * row); };
  const auto block = [this](std::size_t k) { return blocks_[k].template topRows<SIZE>(); };
  for (std::size_t c = 0; c < position_.size(); ++c) {
    const std::size_t diagonal = structure_.first[c];
    block(diagonal).template triangularView<Eigen::Lower>().solveInPlace(at(Eigen::Index(c)));
    for (std::size_t k = diagonal + 1; k < structure_.first[c + 1]; ++k)
      at(structure_.rows[k]) -= block(k).lazyProduct(at(Eigen::Index(c)));
  }
  for (std::size_t c = position_.size(); c-- > 0;) {
    const std::size_t diagonal = structure_.first[c];
    for (std::size_t k = diagonal + 1; k < structure_.first[c + 1]; ++k)
      at(Eigen::Index(c)) -= block(k).transpose().lazyProduct(at(structure_.rows[k]));
    block(diagonal).transpose().template triangularView<Eigen::Upper>().solveInPlace(
        at(Eigen::Index(c)));
  }
  Eigen::MatrixXd result(right.rows(), right.cols());
  for (std::size_t c = 0; c < position_.size(); ++c)
    result.middleRows<SIZE>(SIZE * Eigen::Index(c)) = at(position_[c]);
  return result;
}

/** The inverse is that of L times its transpose: columns of the inverse of L suffice, which begin
 *  at the diagonal. */
template <int SIZE>
Eigen::Matrix<double, SIZE, SIZE>
BlockCholesky<SIZE>::inverseBlock(std::size_t column) const
{
  using Square = Eigen::Matrix<double, SIZE, SIZE>;
  const auto begin = std::size_t(position_[column]), end = position_.size();
  std::vector<Square> x(end - begin, Square::Zero());
  std::vector<char> is_filled(x.size(), 0);
  x.front().setIdentity();
  is_filled.front() = 1;
  Square result = Square::Zero();
  for (std::size_t c = begin; c < end; ++c) {
    if (!is_filled[c - begin])
      continue;
    Square& own = x[c - begin];
    const std::size_t diagonal = structure_.first[c];
    blocks_[diagonal].template topRows<SIZE>().template triangularView<Eigen::Lower>().solveInPlace(
        own);
    result.noalias() += own.transpose() * own;
    for (std::size_t k = diagonal + 1; k < structure_.first[c + 1]; ++k) {
      const std::size_t row = std::size_t(structure_.rows[k]) - begin;
      x[row].noalias() -= blocks_[k].template topRows<SIZE>() * own;
      is_filled[row] = 1;
    }
  }
  return result;
}

template void
subtractProducts<6, 3>(const double*, const double* const*, double* const*, std::size_t);
template void
subtractProducts<9, 3>(const double*, const double* const*, double* const*, std::size_t);
template class BlockCholesky<6>;
template class BlockCholesky<9>;

} // namespace bundle_icp
