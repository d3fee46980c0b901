// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "virtual_depth/reduce_depth.h"

#include "common/depth_edges.h"
#include "common/parallel.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace bundle_icp {
namespace {

constexpr float NOT_MEASURED = std::numeric_limits<float>::quiet_NaN();

void
checkDepth(const cv::Mat& depth, const CameraIntrinsics& camera, int reduction,
           const VirtualDepthOptions& options)
{
  std::string error;
  if (!options.isValid(&error) || !camera.isValid(&error))
    throw BadArgumentException("makeDepthView: " + error);
  if (depth.type() != CV_32FC1)
    throw BadArgumentException("makeDepthView: depth must be CV_32FC1 in metres");
  if (depth.cols != camera.width || depth.rows != camera.height)
    throw BadArgumentException("makeDepthView: depth image is " + std::to_string(depth.cols) + "x" +
                               std::to_string(depth.rows) + ", the camera has " +
                               std::to_string(camera.width) + "x" + std::to_string(camera.height));
  if (reduction < 1 || reduction > std::min(depth.cols, depth.rows) / 8)
    throw BadArgumentException("makeDepthView: reduction " + std::to_string(reduction) +
                               " must be at least 1 and leave 8 pixels in each direction");
}

/** Average of those depths of a block that lie on the surface of the block's median; not measured
 *  when these are less than half of the block. */
float
averageOfSurface(float* depths, std::size_t count, std::size_t block_size, const DepthEdges& linked)
{
  if (2 * count < block_size)
    return NOT_MEASURED;
  float* const middle = depths + (count - 1) / 2;
  std::nth_element(depths, middle, depths + count);
  const float median = *middle;
  float sum = 0, linked_count = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float same = linked(depths[i], median);
    sum += same * depths[i];
    linked_count += same;
  }
  return 2 * linked_count >= float(block_size) ? sum / linked_count : NOT_MEASURED;
}

/** The same for blocks of four depths in any order, without branches. */
BUNDLE_ICP_INLINE void
reduceRowByTwo(const float* upper, const float* lower, int width, DepthEdges linked, float* reduced)
{
  for (int u = 0; u < width; ++u) {
    const float z[4] = {upper[2 * u], upper[2 * u + 1], lower[2 * u], lower[2 * u + 1]};
    float a[4], count = 0;
    for (int i = 0; i < 4; ++i) {
      const bool measured = z[i] > 0;
      a[i] = measured ? z[i] : 1e9f;
      count += measured ? 1.0f : 0.0f;
    }
    const auto sort = [&a](int i, int j) {
      const float low = a[i] < a[j] ? a[i] : a[j], high = a[i] < a[j] ? a[j] : a[i];
      a[i] = low;
      a[j] = high;
    };
    sort(0, 1);
    sort(2, 3);
    sort(0, 2);
    sort(1, 3);
    sort(1, 2);
    const float median = count >= 3 ? a[1] : a[0]; // entry (count - 1) / 2
    float sum = 0, linked_count = 0;
    for (int i = 0; i < 4; ++i) {
      const float same = linked(a[i], median) * (a[i] < 1e9f ? 1.0f : 0.0f);
      sum += same * a[i];
      linked_count += same;
    }
    reduced[u] = linked_count >= 2 ? sum / linked_count : NOT_MEASURED;
  }
}

void
reduceRow(const cv::Mat& depth, int row, int factor, const DepthEdges& linked, cv::Mat& reduced)
{
  const std::size_t block_size = std::size_t(factor) * std::size_t(factor);
  std::vector<float> depths(block_size);
  for (int u = 0; u < reduced.cols; ++u) {
    std::size_t count = 0;
    for (int i = 0; i < factor; ++i)
      for (int j = 0; j < factor; ++j)
        if (const float z = depth.at<float>(row * factor + i, u * factor + j); z > 0)
          depths[count++] = z;
    reduced.at<float>(row, u) = averageOfSurface(depths.data(), count, block_size, linked);
  }
}

} // namespace

cv::Mat
reduceDepth(const cv::Mat& depth, const CameraIntrinsics& camera, int factor,
            const VirtualDepthOptions& options)
{
  checkDepth(depth, camera, factor, options);
  cv::Mat reduced;
  if (factor == 1) {
    reduced = depth.clone();
  }
  else {
    const DepthEdges linked(camera);
    reduced.create(depth.rows / factor, depth.cols / factor, CV_32F);
#pragma omp parallel for num_threads(resolveThreads(options.num_threads)) schedule(static)
    for (int v = 0; v < reduced.rows; ++v)
      if (factor == 2)
        simd::call<reduceRowByTwo>(depth.ptr<float>(2 * v), depth.ptr<float>(2 * v + 1),
                                   reduced.cols, linked, reduced.ptr<float>(v));
      else
        reduceRow(depth, v, factor, linked, reduced);
  }
  // Zero, negative and infinite depths mean "not measured", too.
  reduced.setTo(NOT_MEASURED, ~((reduced > 0) & (reduced < 1e3f)));
  return reduced;
}

} // namespace bundle_icp
