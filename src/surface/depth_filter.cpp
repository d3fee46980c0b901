// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/depth_filter.h"

#include "common/simd.h"

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

namespace bundle_icp {
namespace {

/** Inverse depths that differ by more than this many sigmas belong to other surfaces. The
 *  centre is as noisy as its neighbours, hence more than the usual three. */
constexpr double SURFACE_SIGMAS = 5;

/** One row of inverse depths, 0 = not measured. */
void
invertRow(const float* depth, int width, float* inverse)
{
  for (int x = 0; x < width; ++x)
    inverse[x] = depth[x] > 0 ? 1 / depth[x] : 0;
}

/** Adds one neighbour of each pixel of a row; Tukey's biweight in the difference. */
BUNDLE_ICP_SIMD void
addNeighbours(const float* center,
              const float* neighbour,
              const float* inverse_width,
              float spatial_weight,
              int width,
              float* sum,
              float* weights)
{
  for (int x = 0; x < width; ++x) {
    const float u = (neighbour[x] - center[x]) * inverse_width[x];
    float k = 1 - u * u;
    k = k > 0 ? k : 0;
    k *= k * spatial_weight;
    sum[x] += k * neighbour[x];
    weights[x] += k;
  }
}

} // namespace

cv::Mat
smoothDepth(const cv::Mat& depth, const DepthNoise& noise, int radius, int num_threads)
{
  const int width = depth.cols, height = depth.rows;
  cv::Mat inverse(height + 2 * radius, width + 2 * radius, CV_32FC1, cv::Scalar(0));
#pragma omp parallel for num_threads(num_threads)
  for (int y = 0; y < height; ++y)
    invertRow(depth.ptr<float>(y), width, inverse.ptr<float>(y + radius) + radius);

  cv::Mat smooth(depth.size(), CV_32FC1);
#pragma omp parallel num_threads(num_threads)
  {
    std::vector<float> sum(width), weights(width), inverse_width(width);
#pragma omp for schedule(static)
    for (int y = 0; y < height; ++y) {
      const float* center = inverse.ptr<float>(y + radius) + radius;
      for (int x = 0; x < width; ++x) {
        // sigma of 1/z is sigma / z^2; what is not measured has no neighbours
        const float w = center[x], z = 1 / w;
        inverse_width[x] =
            w > 0 ? float(1 / (SURFACE_SIGMAS * noise.sigma(z) * w * w)) : 1e9f;
      }
      std::fill(sum.begin(), sum.end(), 0.0f);
      std::fill(weights.begin(), weights.end(), 0.0f);
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dx = -radius; dx <= radius; ++dx) {
          const float spatial =
              std::exp(-float(dx * dx + dy * dy) * 2 / float((radius + 1) * (radius + 1)));
          addNeighbours(center,
                        inverse.ptr<float>(y + radius + dy) + radius + dx,
                        inverse_width.data(),
                        spatial,
                        width,
                        sum.data(),
                        weights.data());
        }
      float* out = smooth.ptr<float>(y);
      for (int x = 0; x < width; ++x)
        out[x] = center[x] > 0 ? weights[x] / sum[x] : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return smooth;
}

} // namespace bundle_icp
