// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <utility>
#include <vector>

namespace bundle_icp {

/** Structure of a symmetric matrix's lower triangle: column c holds the blocks rows[k] for first[c]
 *  <= k < first[c + 1], ascending from the diagonal on. */
struct BlockStructure {
  std::vector<std::size_t> first;
  std::vector<int> rows;

  /** From the rows of each column. */
  explicit BlockStructure(const std::vector<std::vector<int>>& columns);

  /** Index of an existing block. */
  std::size_t
  find(int row, int column) const;

  std::size_t
  numColumns() const
  {
    return first.size() - 1;
  }
};

/** A block of SIZE x SIZE numbers, in columns of whole vectors of four: the last rows are unused.
 *  */
template <int SIZE>
using PaddedBlock = Eigen::Matrix<double, (SIZE + 3) / 4 * 4, SIZE>;

/** *blocks[k] -= a[k] b' for count blocks; a[k] and b are padded as blocks are and have INNER
 *  columns, 3 or SIZE. */
template <int SIZE, int INNER>
void
subtractProducts(const double* b, const double* const* a, double* const* blocks, std::size_t count);

/** Cholesky factorisation L L' of a sparse positive definite matrix of blocks, ordered for few
 *  blocks by minimum degree. The order and the blocks of L are found once for many matrices of the
 *  same structure.
 *  \tparam SIZE of a block: 6 or 9 */
template <int SIZE>
class BlockCholesky {
public:
  using Block = PaddedBlock<SIZE>;

  explicit BlockCholesky(const BlockStructure& matrix);

  /** \param blocks of the matrix, as its structure lists them
   *  \return false when it is not positive definite */
  bool
  factorise(const std::vector<Block>& blocks);

  /** The matrix's inverse times `right`. */
  Eigen::MatrixXd
  solve(const Eigen::MatrixXd& right) const;

  /** The block on the diagonal of the matrix's inverse, for a block column of the matrix. */
  Eigen::Matrix<double, SIZE, SIZE>
  inverseBlock(std::size_t column) const;

private:
  /** Place of a block of the matrix in L. */
  struct Target {
    std::size_t block;
    bool is_transposed;
  };

  bool
  factoriseColumn(std::size_t column, std::vector<double*>& block_of);

  std::vector<int> position_; ///< in L, of a block column of the matrix
  std::vector<Target> targets_;
  BlockStructure structure_;
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>>
      left_of_;               ///< of each row: blocks before the
                              ///< diagonal, and their columns' ends
  std::vector<Block> blocks_; ///< of L
};

} // namespace bundle_icp
