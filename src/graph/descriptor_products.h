// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace bundle_icp {

/** Descriptors (CV_8UC1, N x 128, values at most 127) laid out for products: groups of 16,
 *  in each 32 times 4 consecutive values of all 16. Padded with zeros. */
class PackedDescriptors {
public:
  static constexpr int LENGTH = 128;
  static constexpr int GROUP = 16;

  explicit PackedDescriptors(const cv::Mat& descriptors);

  int
  size() const
  {
    return size_;
  }

  int
  groups() const
  {
    return (size_ + GROUP - 1) / GROUP;
  }

  const std::uint8_t*
  group(int g) const
  {
    return data_.data() + std::size_t(g) * GROUP * LENGTH;
  }

private:
  int size_;
  std::vector<std::uint8_t> data_;
};

/** The two best columns of a row of the matrix of products, and its values. */
struct BestProducts {
  int index = -1;
  std::int32_t best = -1;
  std::int32_t second = -1;
};

/** Rows of the matrix product first x second^T, reduced at once: the best two of each row in
 *  `rows`, the index of the best row of each column in `columns`. Exact integers, so the
 *  result does not depend on the instructions that the processor has. */
void
bestProducts(const cv::Mat& first, const PackedDescriptors& second, std::vector<BestProducts>& rows,
             std::vector<int>& columns);

} // namespace bundle_icp
