// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/own_features.h>

#include "landmarks.h"
#include "messages.h"

#include <opencv2/core.hpp>
#include <pcl/exceptions.h>

#include <limits>
#include <numeric>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Keypoints and descriptors that the features of a frame were made from. */
void
takeApart(const Features& features, const std::vector<int>& order,
          std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors)
{
  for (const int j : order) {
    const float scale = features.pixel_sigmas[j] / 0.7f;
    keypoints.emplace_back(features.pixels[j].x(), features.pixels[j].y(), 4 * scale * scale,
                           float(j)); // the angle tells keypoints in one place apart
    descriptors.push_back(features.descriptors.row(j));
  }
}

cv::Mat
randomNumbers(int rows, int cols, bool is_signed, unsigned seed)
{
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  cv::Mat numbers(rows, cols, CV_32FC1);
  for (int i = 0; i < rows; ++i)
    for (int k = 0; k < cols; ++k)
      numbers.at<float>(i, k) = is_signed ? normal(random) : std::abs(normal(random));
  return numbers;
}

/** Products of the rows of two matrices over those of unit vectors. */
cv::Mat
cosines(const cv::Mat& a, const cv::Mat& b)
{
  cv::Mat first, second, products;
  a.convertTo(first, CV_32F, 1.0 / 256);
  b.convertTo(second, CV_32F, 1.0 / 256);
  cv::gemm(first, second, 1, {}, 0, products, cv::GEMM_2_T);
  return products;
}

/** Share of the rows whose largest cosine is that with the same row of the other matrix. */
double
shareMatched(const cv::Mat& a, const cv::Mat& b)
{
  const cv::Mat products = cosines(toDescriptors(a), toDescriptors(b));
  int matched = 0;
  for (int i = 0; i < products.rows; ++i) {
    cv::Point best;
    cv::minMaxLoc(products.row(i), nullptr, nullptr, nullptr, &best);
    matched += best.x == i;
  }
  return double(matched) / products.rows;
}

} // namespace

TEST(OwnFeatures, KeypointsGetTheDepthOfTheLibrarysOwn)
{
  const Features& expected = roomFeatures(0);
  std::vector<int> order(expected.size());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  takeApart(expected, order, keypoints, descriptors);
  const Features features = makeFeatures(keypoints, descriptors, room().read(0), room().camera());
  ASSERT_EQ(features.size(), expected.size());
  EXPECT_EQ(features.sharpness, expected.sharpness);
  EXPECT_EQ(features.pixels, expected.pixels);
  EXPECT_EQ(features.depth_slopes, expected.depth_slopes);
  EXPECT_EQ(features.depth_sigmas, expected.depth_sigmas);
  EXPECT_EQ(features.colors, expected.colors);
  for (std::size_t j = 0; j < features.size(); ++j) {
    EXPECT_EQ(features.hasDepth(j), expected.hasDepth(j));
    if (features.hasDepth(j)) {
      EXPECT_EQ(features.depths[j], expected.depths[j]);
    }
    EXPECT_NEAR(features.pixel_sigmas[j], expected.pixel_sigmas[j], 1e-5);
  }
  EXPECT_EQ(descriptors.rows, features.descriptors.rows);
}

TEST(OwnFeatures, OrderOfKeypointsDoesNotMatter)
{
  std::vector<int> order(roomFeatures(0).size());
  std::iota(order.begin(), order.end(), 0);
  Features results[2];
  for (unsigned i = 0; i < 2; ++i) {
    std::shuffle(order.begin(), order.end(), std::mt19937(i));
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    takeApart(roomFeatures(0), order, keypoints, descriptors);
    results[i] = makeFeatures(keypoints, descriptors, room().read(0), room().camera());
  }
  EXPECT_EQ(results[0].pixels, results[1].pixels);
  EXPECT_EQ(cv::norm(results[0].descriptors, results[1].descriptors, cv::NORM_INF), 0);
}

TEST(OwnFeatures, RefuseWhatDoesNotFitTogether)
{
  const RGBDFrame frame = room().read(0);
  const cv::Mat one = toDescriptors(randomNumbers(1, 128, false, 0));
  const auto error = [&](const cv::Point2f& place, const cv::Mat& descriptors) {
    return messageOf<pcl::BadArgumentException>(
        [&] { makeFeatures({cv::KeyPoint(place, 4)}, descriptors, frame, room().camera()); });
  };
  EXPECT_CONTAINS(error({5, 5}, cv::Mat(2, 128, CV_8UC1)),
                  "makeFeatures: 2 descriptors of 1 keypoints");
  EXPECT_CONTAINS(error({-1, 5}, one), "makeFeatures: keypoint 0 lies outside the image");
  EXPECT_CONTAINS(error({5, std::numeric_limits<float>::quiet_NaN()}, one),
                  "keypoint 0 lies outside the image");
  EXPECT_CONTAINS(error({5, 5}, randomNumbers(1, 128, false, 0)),
                  "the descriptors are 128 numbers of type CV_32FC1");
  EXPECT_CONTAINS(error({5, 5}, cv::Mat(1, 64, CV_8UC1, cv::Scalar(1))),
                  "the descriptors are 64 numbers of type CV_8UC1");
  EXPECT_CONTAINS(error({5, 5}, cv::Mat(1, 128, CV_8UC1, cv::Scalar(200))),
                  "a descriptor holds a number above 127");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [] { makeFeatures({}, cv::Mat(), RGBDFrame(), room().camera()); }),
                  "makeFeatures: frame 0 needs CV_8UC3 colour");
  EXPECT_EQ(makeFeatures({}, cv::Mat(), frame, room().camera()).size(), 0u);
}

TEST(Descriptors, KeepProductsOfNumbersThatAreNotNegative)
{
  for (const int size : {100, 128}) { // of fewer, some are large and cut
    const cv::Mat numbers = randomNumbers(50, size, false, 1);
    const cv::Mat descriptors = toDescriptors(numbers);
    ASSERT_EQ(descriptors.type(), CV_8UC1);
    ASSERT_EQ(descriptors.size(), cv::Size(128, 50));
    const cv::Mat products = cosines(descriptors, descriptors);
    for (int i = 0; i < 50; ++i)
      for (int j = 0; j < 50; ++j) {
        const double exact = numbers.row(i).dot(numbers.row(j)) /
                             (cv::norm(numbers.row(i)) * cv::norm(numbers.row(j)));
        EXPECT_NEAR(products.at<float>(i, j), exact, 0.015);
      }
  }
}

TEST(Descriptors, ScaleDoesNotMatter)
{
  const cv::Mat numbers = randomNumbers(20, 64, true, 2);
  EXPECT_EQ(cv::norm(toDescriptors(numbers), toDescriptors(7 * numbers), cv::NORM_INF), 0);
}

TEST(Descriptors, OppositesHaveNothingInCommon)
{
  const cv::Mat numbers = randomNumbers(20, 64, true, 3);
  const cv::Mat products = cosines(toDescriptors(numbers), toDescriptors(-numbers));
  const cv::Mat own = cosines(toDescriptors(numbers), toDescriptors(numbers));
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(products.at<float>(i, i), 0);
    EXPECT_NEAR(own.at<float>(i, i), 1, 0.02);
  }
}

TEST(Descriptors, SignedOnesOfAnyLengthFindTheirPartners)
{
  for (const int size : {64, 128, 256}) { // KAZE; HardNet; SuperPoint
    const cv::Mat numbers = randomNumbers(500, size, true, 4);
    const cv::Mat others = numbers + 0.5 * randomNumbers(500, size, true, 5);
    EXPECT_GT(shareMatched(numbers, others), 0.95) << size;
  }
}

TEST(Descriptors, BinaryOnesFindTheirPartners)
{
  std::mt19937 random(6);
  cv::Mat bits(500, 32, CV_8UC1);
  cv::RNG(7).fill(bits, cv::RNG::UNIFORM, 0, 256);
  cv::Mat others = bits.clone();
  for (int i = 0; i < bits.rows; ++i)
    for (int k = 0; k < 30; ++k) // of 256 bits
      others.at<std::uint8_t>(i, int(random() % 32)) ^= std::uint8_t(1 << (random() % 8));
  EXPECT_GT(shareMatched(bits, others), 0.95);
}

TEST(Descriptors, WithoutLengthTheyMatchNothing)
{
  EXPECT_EQ(cv::countNonZero(toDescriptors(cv::Mat(2, 64, CV_32FC1, cv::Scalar(0)))), 0);
  EXPECT_EQ(toDescriptors(cv::Mat()).size(), cv::Size(128, 0));
  cv::Mat one(1, 64, CV_32FC1, cv::Scalar(0));
  one.at<float>(0, 3) = 5;
  EXPECT_EQ(toDescriptors(one).at<std::uint8_t>(0, 3), 127); // cut: it holds more than half
}

TEST(Descriptors, RefuseOtherTypes)
{
  const auto error = [](const cv::Mat& numbers) {
    return messageOf<pcl::BadArgumentException>([&] { toDescriptors(numbers); });
  };
  EXPECT_CONTAINS(error(cv::Mat(1, 64, CV_64FC1, cv::Scalar(1))),
                  "toDescriptors: descriptors of type CV_64FC1; they must be CV_32FC1");
  EXPECT_CONTAINS(
      error(cv::Mat(1, 64, CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()))),
      "toDescriptors: a descriptor holds a number that is not finite");
}
