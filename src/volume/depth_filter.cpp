// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/depth_filter.h"
#include "common/depth_sigma.h"
#include "common/simd.h"

#include <array>
#include <limits>
#include <opencv2/core.hpp>
#include <utility>

namespace bundle_icp {
namespace {

using namespace simd;

/** Half the number of taps of a pass along each axis. */
constexpr int REACH = 2;
constexpr int TAPS = 2 * REACH + 1;
/** A B-spline's, the usual one of this transform. */
constexpr std::array<float, TAPS> SPATIAL = {1, 4, 6, 4, 1};
/** Difference of inverse depths, in sigmas, beyond which they belong to different surfaces. It
 *  exceeds the usual three, because the centre is as noisy as its neighbours; after each pass both
 *  are less noisy. */
constexpr std::array<float, 3> SURFACE_SIGMAS = {5, 3.5F, 2.5F};

/** Inverse depths with a margin of zeros, as wide as the taps reach, and vectors to the right. */
struct PaddedImage {
  PaddedImage(int width, int height, int reach)
  : margin(reach), pixels(height + 2 * reach, width + 2 * reach + LANES, CV_32FC1, cv::Scalar(0))
  {
  }

  float*
  row(int y)
  {
    return pixels.ptr<float>(y + margin) + margin;
  }

  const float*
  row(int y) const
  {
    return pixels.ptr<float>(y + margin) + margin;
  }

  int margin;
  cv::Mat pixels;
};

struct PassOptions {
  int spacing;      ///< of the taps [px]
  DepthSigma reach; ///< where a neighbour belongs to another surface
};

void
invertRow(const float* depth, int width, float* inverse)
{
  for (int x = 0; x < width; ++x)
    inverse[x] = depth[x] > 0 ? 1 / depth[x] : 0;
}

void
invertBack(const float* inverse, int width, float* depth)
{
  for (int x = 0; x < width; ++x)
    depth[x] = inverse[x] > 0 ? 1 / inverse[x] : std::numeric_limits<float>::quiet_NaN();
}

/** One row of a pass. Tukey's biweight in the difference from the centre. */
BUNDLE_ICP_INLINE void
smoothRow(const std::array<const float*, TAPS>& rows, int width, const PassOptions& options,
          float* out)
{
  for (int x = 0; x < width; x += LANES) {
    const Floats center = load<Floats>(rows[REACH] + x);
    const Ints known = center > 0;
    const Floats z = 1 / (known ? center : Floats{} + 1);
    // sigma of 1/z is sigma / z^2
    // At most the width at which a pixel without depth, 0 here, still has no weight.
    const Floats inverse_width = larger(z * z / options.reach(z), z);
    Floats sum{}, weights{};
    for (int j = 0; j < TAPS; ++j)
      for (int i = 0; i < TAPS; ++i) {
        const Floats neighbour = load<Floats>(rows[j] + x + (i - REACH) * options.spacing);
        const Floats u = (neighbour - center) * inverse_width;
        const Floats falloff = larger(1 - u * u, Floats{});
        const Floats weight = falloff * falloff * (SPATIAL[i] * SPATIAL[j]);
        sum += weight * neighbour;
        weights += weight;
      }
    const Floats result = known ? sum / weights : Floats{};
    std::memcpy(out + x, &result, sizeof(result));
  }
}

void
smoothOnce(const PaddedImage& in, int width, int height, const PassOptions& options,
           int num_threads, PaddedImage& out)
{
#pragma omp parallel for schedule(static) num_threads(num_threads)
  for (int y = 0; y < height; ++y) {
    std::array<const float*, TAPS> rows;
    for (int j = 0; j < TAPS; ++j)
      rows[j] = in.row(y + (j - REACH) * options.spacing);
    call<smoothRow>(rows, width, options, out.row(y));
    // The last vector reaches into the margin, which must stay zero.
    std::fill_n(out.row(y) + width, LANES, 0.0F);
  }
}

} // namespace

int
smoothingPasses(int radius)
{
  int passes = 0;
  for (int reached = 0; reached < radius && passes < int(SURFACE_SIGMAS.size()); ++passes)
    reached += REACH << passes;
  return passes;
}

cv::Mat
smoothDepth(const cv::Mat& depth, const DepthNoise& noise, int radius, int num_threads)
{
  const int width = depth.cols, height = depth.rows;
  const int passes = smoothingPasses(radius);
  const int margin = std::max(1, REACH << passes);
  PaddedImage from(width, height, margin), to(width, height, margin);
#pragma omp parallel for num_threads(num_threads)
  for (int y = 0; y < height; ++y)
    invertRow(depth.ptr<float>(y), width, from.row(y));
  for (int pass = 0; pass < passes; ++pass) {
    const PassOptions options{1 << pass, DepthSigma(noise, SURFACE_SIGMAS[pass])};
    smoothOnce(from, width, height, options, num_threads, to);
    std::swap(from, to);
  }
  cv::Mat smooth(depth.size(), CV_32FC1);
#pragma omp parallel for num_threads(num_threads)
  for (int y = 0; y < height; ++y)
    invertBack(from.row(y), width, smooth.ptr<float>(y));
  return smooth;
}

} // namespace bundle_icp
