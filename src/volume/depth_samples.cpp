// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/depth_samples.h"
#include "common/depth_edges.h"
#include "common/simd.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

using namespace simd;

// Half the distance of the two pixels that give the slope: far enough to average depth
// noise, near enough to follow furniture.
constexpr int SLOPE_RADIUS = 3;

struct RowInput {
  /** Depth around the current row, zeros outside the image. */
  const float* rows[2 * SLOPE_RADIUS + 1];
  int width;
  float fx, fy, cx, y; // y is that of the ray (x, y, 1)
  float v_minus_cy;    // [px]
  DepthSigma sigma;
  DepthEdges edges;
  float unit_variance; // of a depth of weight 1 [m^2]
};

void
copyDepthRow(const float* from, float near, float far, int width, float* to)
{
  for (int u = 0; u < width; ++u)
    to[u] = from[u] >= near && from[u] <= far ? from[u] : 0.0f; // NaN fails both
}

void
copyColorRow(const std::uint8_t* from, int width, std::uint32_t* to)
{
  for (int u = 0; u < width; ++u, from += 3)
    to[u] = std::uint32_t(from[0]) | std::uint32_t(from[1]) << 8 | std::uint32_t(from[2]) << 16;
}

// Cosine between the ray and the normal of the surface z(u, v).
BUNDLE_ICP_INLINE Floats
viewingCosine(const RowInput& in, const float* const rows[], Floats z, Floats limit, int at, int u)
{
  const float focal = in.fx;
  const auto slope = [ z, limit, focal ](Floats before, Floats after) __attribute__((always_inline))
  {
    const Ints has_before = magnitude(before - z) < limit;
    const Ints has_after = magnitude(after - z) < limit;
    const Floats rise = (has_after ? after : z) - (has_before ? before : z);
    const Floats run = (has_before & has_after) ? 2.0f * SLOPE_RADIUS : Floats{} + SLOPE_RADIUS;
    // Unknown on both sides is too steep to tell: little weight.
    return (has_before | has_after) ? rise / run : z * (4 / focal);
  };
  const float* const row = rows[SLOPE_RADIUS] + at;
  const Floats zu = slope(load<Floats>(row - SLOPE_RADIUS), load<Floats>(row + SLOPE_RADIUS));
  const Floats zv = slope(load<Floats>(rows[0] + at), load<Floats>(rows[2 * SLOPE_RADIUS] + at));
  const Floats du = LANE_NUMBER + (float(u) - in.cx);
  const Floats nx = in.fx * zu, ny = in.fy * zv, nz = z + du * zu + in.v_minus_cy * zv;
  const Floats x = du * (1 / in.fx);
  const Floats ray = x * x + (in.y * in.y + 1), normal = nx * nx + ny * ny + nz * nz + 1e-12f;
  // The product of this normal with the ray (x, y, 1) is z.
  return z * inverseSquareRoot(normal) * inverseSquareRoot(ray);
}

// Eight of a pixel's neighbours vote; fewer than three agree with a flying pixel
// between two surfaces.
BUNDLE_ICP_INLINE Floats
edgeSupport(Floats z, Floats limit, const float* const rows[], int u)
{
  Ints votes{};
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x)
      votes -= magnitude(load<Floats>(rows[SLOPE_RADIUS + y] + u + x) - z) < limit;
  votes -= 1; // its own
  return votes < 3 ? 0.0f : __builtin_convertvector(votes, Floats) * 0.125f;
}

// Mask of the pixels with nothing but their own surface two pixels around.
BUNDLE_ICP_INLINE Ints
isInsideSurface(const RowInput& in, Floats z, const float* const rows[], int u)
{
  Ints inside = z > 0;
  for (const int radius : {1, 2}) {
    const Floats limit = in.edges.tolerance(z, float(radius));
    for (int y = -radius; y <= radius; y += radius)
      for (int x = -radius; x <= radius; x += radius)
        inside &= magnitude(load<Floats>(rows[SLOPE_RADIUS + y] + u + x) - z) < limit;
  }
  return inside;
}

// The pixels u ... u + 7, which lie at `at` in the rows; `color` may be null.
BUNDLE_ICP_INLINE void
weighEight(const RowInput& in, const float* const rows[], int at, int u, float* weights,
           std::uint32_t* color)
{
  const Floats z = load<Floats>(rows[SLOPE_RADIUS] + at);
  const Floats sigma = in.sigma(z);
  const Floats cosine =
      viewingCosine(in, rows, z, in.edges.tolerance(z, float(SLOPE_RADIUS)), at, u);
  const Floats support = edgeSupport(z, in.edges.tolerance(z), rows, at);
  const Floats weight = in.unit_variance / (sigma * sigma) * cosine * support * support;
  const Floats result = z > 0 ? weight : 0.0f;
  std::memcpy(weights + u, &result, sizeof(result));
  if (!color)
    return;
  const Words quality = isInsideSurface(in, z, rows, at) ? Words{} + BEST_QUALITY : Words{} + 1;
  const Words graded =
      (load<Words>(color + u) & ((1u << QUALITY_SHIFT) - 1)) | quality << QUALITY_SHIFT;
  std::memcpy(color + u, &graded, sizeof(graded));
}

// Eight pixels at an end of the row, whose neighbours may lie outside.
BUNDLE_ICP_INLINE void
weighEnd(const RowInput& in, int u, float* weights, std::uint32_t* color)
{
  float padded[2 * SLOPE_RADIUS + 1][LANES + 2 * SLOPE_RADIUS];
  const float* rows[2 * SLOPE_RADIUS + 1];
  for (int y = 0; y <= 2 * SLOPE_RADIUS; ++y) {
    for (int i = 0; i < LANES + 2 * SLOPE_RADIUS; ++i) {
      const int x = u + i - SLOPE_RADIUS;
      padded[y][i] = x >= 0 && x < in.width ? in.rows[y][x] : 0.0f;
    }
    rows[y] = padded[y];
  }
  weighEight(in, rows, SLOPE_RADIUS, u, weights, color);
}

BUNDLE_ICP_INLINE void
weightRow(const RowInput& in, float* weights, std::uint32_t* color)
{
  weighEnd(in, 0, weights, color);
  const int end = in.width - SLOPE_RADIUS;
  for (int u = SLOPE_RADIUS; u < end; u += LANES) {
    const int first = std::min(u, end - LANES);
    weighEight(in, in.rows, first, first, weights, color);
  }
  weighEnd(in, in.width - LANES, weights, color);
}

RowInput
rowInput(const DepthSamples& samples, int v, const float* zeros, double unit_sigma)
{
  const CameraIntrinsics& camera = samples.camera;
  RowInput in;
  for (int i = -SLOPE_RADIUS; i <= SLOPE_RADIUS; ++i) {
    const int neighbor = v + i;
    const bool outside = neighbor < 0 || neighbor >= camera.height;
    in.rows[i + SLOPE_RADIUS] =
        outside ? zeros : &samples.depth[std::size_t(neighbor) * camera.width];
  }
  in.width = camera.width;
  in.fx = float(camera.fx);
  in.fy = float(camera.fy);
  in.cx = float(camera.cx);
  in.v_minus_cy = float(v - camera.cy);
  in.y = in.v_minus_cy / in.fy;
  in.sigma = DepthSigma(camera.depth_noise);
  in.edges = DepthEdges(camera);
  in.unit_variance = float(unit_sigma * unit_sigma);
  return in;
}

// Range of depth within one tile; (infinity, 0) when nothing is measured there.
Eigen::Vector2f
tileRange(const float* corner, int stride, int width, int height)
{
  float low = INFINITY, high = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const float z = corner[v * stride + u];
      low = z > 0 && z < low ? z : low;
      high = z > high ? z : high;
    }
  return {low, high};
}

} // namespace

DepthSamples::DepthSamples(const RGBDFrame& frame, const CameraIntrinsics& frame_camera,
                           const TSDFOptions& options, double unit_sigma, int num_threads)
: camera(frame_camera)
{
  const int width = camera.width, height = camera.height;
  const std::size_t pixels = std::size_t(width) * height;
  depth.resize(pixels);
  weight.assign(pixels, 0.0f);
  color.resize(frame.color.empty() ? 0 : pixels);
  tiles_x = (width + tile - 1) / tile;
  tiles_y = (height + tile - 1) / tile;
  depth_range.resize(std::size_t(tiles_x) * tiles_y);
  const std::vector<float> zeros(width, 0.0f);

#pragma omp parallel num_threads(num_threads)
  {
#pragma omp for
    for (int v = 0; v < height; ++v) {
      copyDepthRow(frame.depth.ptr<float>(v), float(options.min_depth), float(options.max_depth),
                   width, &depth[std::size_t(v) * width]);
      if (!color.empty())
        copyColorRow(frame.color.ptr(v), width, &color[std::size_t(v) * width]);
    }
#pragma omp for nowait
    for (int v = 0; v < height; ++v)
      call<weightRow>(rowInput(*this, v, zeros.data(), unit_sigma), &weight[std::size_t(v) * width],
                      color.empty() ? nullptr : &color[std::size_t(v) * width]);
#pragma omp for
    for (int i = 0; i < tiles_x * tiles_y; ++i) {
      const int u = i % tiles_x * tile, v = i / tiles_x * tile;
      depth_range[i] = tileRange(&depth[std::size_t(v) * width + u], width,
                                 std::min(tile, width - u), std::min(tile, height - v));
    }
  }
}

} // namespace bundle_icp
