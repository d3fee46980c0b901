// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "graph/descriptor_products.h"

#include "landmarks.h"
#include "variants.h"

#include "graph/descriptor_tree.h"

#include <gtest/gtest.h>

#include <thread>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Any values that descriptors may have, the largest included. */
cv::Mat
randomDescriptors(int count, unsigned seed)
{
  std::mt19937 random(seed);
  cv::Mat descriptors(count, PackedDescriptors::LENGTH, CV_8UC1);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < descriptors.cols; ++k)
      descriptors.at<std::uint8_t>(i, k) = std::uint8_t(random() % 128);
  return descriptors;
}

std::int32_t
product(const cv::Mat& a, int i, const cv::Mat& b, int j)
{
  std::int32_t sum = 0;
  for (int k = 0; k < a.cols; ++k)
    sum += a.at<std::uint8_t>(i, k) * b.at<std::uint8_t>(j, k);
  return sum;
}

/** What bestProducts() should find, one product at a time; the lowest index wins. */
void
expectNaiveResult(const cv::Mat& first, const cv::Mat& second)
{
  std::vector<BestProducts> rows;
  std::vector<int> columns;
  bestProducts(first, PackedDescriptors(second), rows, columns);
  ASSERT_EQ(rows.size(), std::size_t(first.rows));
  ASSERT_EQ(columns.size(), std::size_t(second.rows));
  std::vector<std::int32_t> column_best(second.rows, -1);
  std::vector<int> naive_columns(second.rows, -1);
  for (int i = 0; i < first.rows; ++i) {
    BestProducts naive;
    for (int j = 0; j < second.rows; ++j) {
      const std::int32_t p = product(first, i, second, j);
      if (p > naive.best) {
        naive.second = naive.best;
        naive.best = p;
        naive.index = j;
      }
      else
        naive.second = std::max(naive.second, p);
      if (p > column_best[j]) {
        column_best[j] = p;
        naive_columns[j] = i;
      }
    }
    ASSERT_EQ(rows[i].index, naive.index) << "row " << i;
    ASSERT_EQ(rows[i].best, naive.best) << "row " << i;
    ASSERT_EQ(rows[i].second, naive.second) << "row " << i;
  }
  EXPECT_EQ(columns, naive_columns);
}

} // namespace

TEST(DescriptorProducts, EqualIntegerProductsForAnySize)
{
  for (const int size : {1, 15, 16, 17, 1000})
    for (const int other : {1, 5, 16, 17, 33}) {
      SCOPED_TRACE(std::to_string(other) + " x " + std::to_string(size));
      forEachVariant(
          [&] { expectNaiveResult(randomDescriptors(other, 1), randomDescriptors(size, 2)); });
    }
}

TEST(DescriptorProducts, DoNotSaturate)
{
  const cv::Mat largest(20, PackedDescriptors::LENGTH, CV_8UC1, cv::Scalar(127));
  std::vector<BestProducts> rows;
  std::vector<int> columns;
  forEachVariant([&] {
    bestProducts(largest, PackedDescriptors(largest), rows, columns);
    for (const BestProducts& row : rows)
      EXPECT_EQ(row.best, 128 * 127 * 127);
  });
}

TEST(DescriptorProducts, LowestIndexWinsTies)
{
  const cv::Mat distinct = randomDescriptors(25, 3);
  cv::Mat twice = distinct.clone();
  twice.push_back(distinct);
  expectNaiveResult(twice, twice);
  std::vector<BestProducts> rows;
  std::vector<int> columns;
  bestProducts(twice, PackedDescriptors(twice), rows, columns);
  for (const BestProducts& row : rows) {
    EXPECT_LT(row.index, 25);
    EXPECT_EQ(row.best, row.second);
  }
  for (const int row : columns)
    EXPECT_LT(row, 25);
}

TEST(DescriptorProducts, NoColumnsGiveNoBest)
{
  std::vector<BestProducts> rows;
  std::vector<int> columns;
  const cv::Mat none(0, PackedDescriptors::LENGTH, CV_8UC1);
  bestProducts(randomDescriptors(3, 1), PackedDescriptors(none), rows, columns);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].index, -1);
  bestProducts(none, PackedDescriptors(randomDescriptors(3, 1)), rows, columns);
  EXPECT_EQ(columns, std::vector<int>(3, -1));
}

TEST(DescriptorTree, FindsItsOwnDescriptors)
{
  const cv::Mat descriptors = Landmarks(300).descriptors();
  const std::vector<BestProducts> best = DescriptorTree(descriptors).bestProducts(descriptors);
  int right = 0;
  for (int i = 0; i < descriptors.rows; ++i)
    right += best[i].index == i;
  EXPECT_GE(right, 295);
}

TEST(DescriptorTree, IsTheSameEachTime)
{
  // Enough that FLANN's own trees, which it draws by chance, answer differently each time.
  const cv::Mat descriptors = randomDescriptors(3000, 1), queries = randomDescriptors(300, 2);
  const std::vector<BestProducts> once = DescriptorTree(descriptors).bestProducts(queries);
  std::vector<std::vector<BestProducts>> again(2);
  std::thread other([&] { again[0] = DescriptorTree(descriptors).bestProducts(queries); });
  again[1] = DescriptorTree(descriptors).bestProducts(queries);
  other.join();
  for (const std::vector<BestProducts>& best : again)
    for (int i = 0; i < queries.rows; ++i) {
      EXPECT_EQ(best[i].index, once[i].index);
      EXPECT_EQ(best[i].second, once[i].second);
    }
}

TEST(DescriptorTree, ManyTimesTheSameDescriptor)
{
  const cv::Mat same = cv::repeat(randomDescriptors(1, 1), 5000, 1);
  EXPECT_EQ(DescriptorTree(same).bestProducts(same.row(0))[0].best,
            DescriptorTree(same).bestProducts(same.row(0))[0].second);
}

TEST(DescriptorTree, AgreesWithProductsOnARenderedPair)
{
  const cv::Mat &first = roomFeatures(0).descriptors, &second = roomFeatures(4).descriptors;
  MatchingOptions options;
  const std::vector<FeatureMatch> exact = matchDescriptors(first, second, options);
  options.backend = MatchingBackend::KDTREE;
  const std::vector<FeatureMatch> tree = matchDescriptors(first, second, options);
  ASSERT_GT(exact.size(), 100u);
  std::size_t same = 0;
  for (const FeatureMatch& a : exact)
    for (const FeatureMatch& b : tree)
      same += a.first == b.first && a.second == b.second;
  EXPECT_GT(same, 9 * exact.size() / 10);
  EXPECT_GT(same, 9 * tree.size() / 10);
}
