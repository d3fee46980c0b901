// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/block_cholesky.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <random>

using namespace bundle_icp;

namespace {

/** A random positive definite matrix: a long scan that comes back to where it was, twice. */
template <int SIZE>
struct Example {
  static constexpr int COLUMNS = 30;
  BlockStructure structure;
  std::vector<PaddedBlock<SIZE>> blocks;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(SIZE * COLUMNS, SIZE* COLUMNS);

  Example() : structure(columns()), blocks(structure.rows.size(), PaddedBlock<SIZE>::Zero())
  {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (int c = 0; c < COLUMNS; ++c)
      for (std::size_t k = structure.first[std::size_t(c)]; k < structure.first[std::size_t(c) + 1];
           ++k) {
        const int r = structure.rows[k];
        Eigen::Matrix<double, SIZE, SIZE> block = block.NullaryExpr([&] { return normal(random); });
        if (r == c)
          block = (block + block.transpose() + 60 * block.Identity()).eval();
        blocks[k].template topRows<SIZE>() = block;
        matrix.block<SIZE, SIZE>(SIZE * r, SIZE * c) = block;
        matrix.block<SIZE, SIZE>(SIZE * c, SIZE * r) = block.transpose();
      }
  }

  static std::vector<std::vector<int>>
  columns()
  {
    std::vector<std::vector<int>> columns(COLUMNS);
    for (int c = 0; c < COLUMNS; ++c)
      for (const int row : {c, c + 1, c + 2, c + 11, 29 - c})
        if (row >= c && row < COLUMNS &&
            (columns[std::size_t(c)].empty() || columns[std::size_t(c)].back() < row))
          columns[std::size_t(c)].push_back(row);
    return columns;
  }
};

template <int SIZE>
void
expectInverse()
{
  Example<SIZE> example;
  BlockCholesky<SIZE> cholesky(example.structure);
  const Eigen::MatrixXd right = Eigen::MatrixXd::Random(example.matrix.rows(), 3);
  for (int round = 0; round < 2; ++round) { // the second factorisation forgets the first
    ASSERT_TRUE(cholesky.factorise(example.blocks));
    EXPECT_LT((example.matrix * cholesky.solve(right) - right).norm(), 1e-10);
  }
  PaddedBlock<SIZE>& last = example.blocks.back();
  last(SIZE - 1, SIZE - 1) = -1;
  EXPECT_FALSE(cholesky.factorise(example.blocks));
}

} // namespace

TEST(BlockCholesky, SolvesAsTheDenseMatrix)
{
  expectInverse<6>();
  expectInverse<9>();
}

TEST(BlockCholesky, OfNothingIsNothing)
{
  BlockCholesky<6> cholesky{BlockStructure{std::vector<std::vector<int>>{}}};
  EXPECT_TRUE(cholesky.factorise({}));
  EXPECT_EQ(cholesky.solve(Eigen::MatrixXd(0, 2)).size(), 0);
}
