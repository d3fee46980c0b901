// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "reduce_depth.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace bundle_icp {
namespace {

constexpr float NOT_MEASURED = std::numeric_limits<float>::quiet_NaN();

/** Average of the depths of a block that lie on the surface of their median; not
 * measured when that is less than half of the block. */
float
averageOfSurface(std::vector<float>& depths, std::size_t block_size,
                 const SurfaceLink& linked)
{
  if (2 * depths.size() < block_size)
    return NOT_MEASURED;
  const auto middle =
      depths.begin() + static_cast<std::ptrdiff_t>((depths.size() - 1) / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  const float median = *middle;
  float sum = 0, count = 0;
  for (const float z : depths) {
    const float same = linked(z, median);
    sum += same * z;
    count += same;
  }
  return 2 * count >= static_cast<float>(block_size) ? sum / count : NOT_MEASURED;
}

} // namespace

cv::Mat
reducedDepth(const cv::Mat& depth, int factor, const SurfaceLink& linked, int threads)
{
  cv::Mat reduced(depth.rows / factor, depth.cols / factor, CV_32F);
  const std::size_t block_size =
      static_cast<std::size_t>(factor) * static_cast<std::size_t>(factor);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (int v = 0; v < reduced.rows; ++v) {
    std::vector<float> depths;
    depths.reserve(block_size);
    for (int u = 0; u < reduced.cols; ++u) {
      depths.clear();
      for (int i = 0; i < factor; ++i)
        for (int j = 0; j < factor; ++j)
          if (const float z = depth.at<float>(v * factor + i, u * factor + j); z > 0)
            depths.push_back(z);
      reduced.at<float>(v, u) = averageOfSurface(depths, block_size, linked);
    }
  }
  return reduced;
}

} // namespace bundle_icp
