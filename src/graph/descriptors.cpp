// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/graph/own_features.h>

#include "graph/feature_checks.h"

#include <bundle_icp/common/exceptions.h>

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace bundle_icp {
namespace {

/** Signed numbers take two places each: one for the positive part, one for the negative. */
constexpr int SIGNED_SIZE = DESCRIPTOR_SIZE / 2;

/** The bits of binary descriptors as 1 and -1: their product falls as their Hamming distance
 *  rises. */
cv::Mat
fromBits(const cv::Mat& bytes)
{
  cv::Mat numbers(bytes.rows, 8 * bytes.cols, CV_32FC1);
  for (int i = 0; i < bytes.rows; ++i)
    for (int k = 0; k < numbers.cols; ++k)
      numbers.at<float>(i, k) = (bytes.at<std::uint8_t>(i, k / 8) >> (k % 8)) & 1 ? 1.0f : -1.0f;
  return numbers;
}

/** A count sketch (Charikar et al., 2002): places are shared, signs make products of what shares a
 *  place cancel on average. */
cv::Mat
fold(const cv::Mat& numbers)
{
  std::mt19937 random(1);
  cv::Mat folded(numbers.rows, SIGNED_SIZE, CV_32FC1, cv::Scalar(0));
  for (int k = 0; k < numbers.cols; ++k) {
    const float sign = random() & 1 ? 1.0f : -1.0f;
    for (int i = 0; i < numbers.rows; ++i)
      folded.at<float>(i, k % SIGNED_SIZE) += sign * numbers.at<float>(i, k);
  }
  return folded;
}

cv::Mat
splitSigns(const cv::Mat& numbers)
{
  cv::Mat parts(numbers.rows, DESCRIPTOR_SIZE, CV_32FC1, cv::Scalar(0));
  parts.colRange(0, numbers.cols) += cv::max(numbers, 0);
  parts.colRange(SIGNED_SIZE, SIGNED_SIZE + numbers.cols) += cv::max(-numbers, 0);
  return parts;
}

cv::Mat
scaleToUnits(const cv::Mat& numbers)
{
  cv::Mat units(numbers.rows, DESCRIPTOR_SIZE, CV_8UC1, cv::Scalar(0));
  for (int i = 0; i < numbers.rows; ++i) {
    const float length = float(cv::norm(numbers.row(i)));
    for (int k = 0; length > 0 && k < numbers.cols; ++k)
      units.at<std::uint8_t>(i, k) = std::uint8_t(
          std::min(float(LARGEST_IN_DESCRIPTOR), numbers.at<float>(i, k) / length * 256.0f + 0.5f));
  }
  return units;
}

} // namespace

cv::Mat
toDescriptors(const cv::Mat& descriptors)
{
  if (descriptors.empty())
    return cv::Mat(0, DESCRIPTOR_SIZE, CV_8UC1);
  if (descriptors.type() != CV_32FC1 && descriptors.type() != CV_8UC1)
    throw BadArgumentException("toDescriptors: descriptors of type " +
                               cv::typeToString(descriptors.type()) +
                               "; they must be CV_32FC1, or CV_8UC1 with bits");
  const cv::Mat numbers = descriptors.depth() == CV_8U ? fromBits(descriptors) : descriptors;
  if (!cv::checkRange(numbers))
    throw BadArgumentException("toDescriptors: a descriptor holds a number that is not finite");
  const bool is_signed = numbers.cols > DESCRIPTOR_SIZE || cv::countNonZero(numbers < 0) > 0;
  if (!is_signed)
    return scaleToUnits(numbers);
  return scaleToUnits(splitSigns(numbers.cols > SIGNED_SIZE ? fold(numbers) : numbers));
}

} // namespace bundle_icp
