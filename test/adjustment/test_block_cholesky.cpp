// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/block_cholesky.h"

#include "variants.h"

#include <Eigen/Dense>

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
  const Eigen::MatrixXd inverse = example.matrix.inverse();
  for (std::size_t k = 0; k < example.structure.numColumns(); ++k) {
    const Eigen::Index at = SIZE * Eigen::Index(k);
    const Eigen::MatrixXd expected = inverse.block(at, at, SIZE, SIZE);
    EXPECT_LT((cholesky.inverseBlock(k) - expected).norm(), 1e-10 * inverse.norm()) << k;
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

TEST(BlockCholesky, IsTheSameForAnySimdVariant)
{
  const Example<9> example;
  const Eigen::MatrixXd right = Eigen::MatrixXd::Ones(example.matrix.rows(), 2);
  Eigen::MatrixXd first;
  test::forEachVariant([&] {
    BlockCholesky<9> cholesky(example.structure);
    ASSERT_TRUE(cholesky.factorise(example.blocks));
    const Eigen::MatrixXd solution = cholesky.solve(right);
    if (first.size() == 0)
      first = solution;
    EXPECT_EQ(solution, first);
  });
}

TEST(BlockCholesky, FactorisesAgainAfterAMatrixThatIsNotPositive)
{
  Example<6> example;
  BlockCholesky<6> cholesky(example.structure);
  std::vector<PaddedBlock<6>> negative = example.blocks;
  negative.front().diagonal().setConstant(-1);
  EXPECT_FALSE(cholesky.factorise(negative));
  ASSERT_TRUE(cholesky.factorise(example.blocks));
  const Eigen::MatrixXd right = Eigen::MatrixXd::Ones(example.matrix.rows(), 1);
  EXPECT_LT((example.matrix * cholesky.solve(right) - right).norm(), 1e-10);
}

TEST(BlockCholesky, BlocksApartAreSolvedApart)
{
  // Only the diagonal: each block is a system of its own, whatever the others are.
  const BlockStructure structure{std::vector<std::vector<int>>{{0}, {1}, {2}}};
  std::vector<PaddedBlock<6>> blocks(3, PaddedBlock<6>::Zero());
  for (int k = 0; k < 3; ++k)
    blocks[std::size_t(k)].diagonal().setConstant(k + 2);
  BlockCholesky<6> cholesky(structure);
  ASSERT_TRUE(cholesky.factorise(blocks));
  const Eigen::MatrixXd solution = cholesky.solve(Eigen::MatrixXd::Ones(18, 1));
  for (int k = 0; k < 18; ++k)
    EXPECT_DOUBLE_EQ(solution(k), 1.0 / (k / 6 + 2));
}

TEST(BlockStructure, FindsItsBlocks)
{
  const BlockStructure structure{std::vector<std::vector<int>>{{0, 2, 5}, {1}, {2, 5}, {}}};
  EXPECT_EQ(structure.numColumns(), 4u);
  EXPECT_EQ(structure.find(0, 0), 0u);
  EXPECT_EQ(structure.find(5, 0), 2u);
  EXPECT_EQ(structure.find(1, 1), 3u);
  EXPECT_EQ(structure.find(5, 2), 5u);
}

namespace {

template <int SIZE>
void
expectProducts()
{
  using Factor = Eigen::Matrix<double, PaddedBlock<SIZE>::RowsAtCompileTime, 3>;
  std::vector<Factor> factors;
  std::vector<PaddedBlock<SIZE>> blocks;
  for (int k = 0; k < 4; ++k) {
    factors.push_back(Factor::Random());
    blocks.push_back(PaddedBlock<SIZE>::Random());
  }
  std::vector<PaddedBlock<SIZE>> before = blocks;
  std::vector<const double*> a;
  std::vector<double*> targets;
  for (std::size_t k = 0; k < 3; ++k) { // the last one is left alone
    a.push_back(factors[k].data());
    targets.push_back(blocks[k].data());
  }
  subtractProducts<SIZE, 3>(factors[1].data(), a.data(), targets.data(), a.size());
  for (std::size_t k = 0; k < 3; ++k) {
    const auto product = factors[k] * factors[1].template topRows<SIZE>().transpose();
    EXPECT_LT((before[k] - product - blocks[k]).template topRows<SIZE>().norm(), 1e-13);
  }
  EXPECT_EQ(blocks[3], before[3]);
}

} // namespace

TEST(SubtractProducts, TakeTheProductsOfTheirFactors)
{
  test::forEachVariant([] {
    expectProducts<6>();
    expectProducts<9>();
  });
}
