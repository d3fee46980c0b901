// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/depth_edges.h"
#include "common/parallel.h"
#include "virtual_depth/reduce_depth.h"

#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

constexpr float NOT_MEASURED = std::numeric_limits<float>::quiet_NaN();
/** Largest radius of the window that a normal is fitted to [px]. */
constexpr int MAX_RADIUS = 7;
/** Standard deviation of a normal that the radius is chosen for [rad]. */
constexpr double NORMAL_SIGMA = 0.07;

/** Images with a margin of MAX_RADIUS, so that the loops need no test at the border. */
cv::Mat
paddedImage(const cv::Size& size)
{
  return cv::Mat::zeros(size.height + 2 * MAX_RADIUS, size.width + 2 * MAX_RADIUS, CV_32F);
}

float*
paddedRow(cv::Mat& image, int row)
{
  return image.ptr<float>(row + MAX_RADIUS) + MAX_RADIUS;
}

/** Data for the fit of normals. A plane's inverse depth is an affine function of the pixel. Its two
 *  slopes and its value give the normal without bias by perspective. */
struct Planes {
  cv::Mat inverse_depth;    // 1 / z [1/m], 0 = not measured
  cv::Mat link_right;       // 1 when linked to the right neighbour
  cv::Mat link_down;        // 1 when linked to the neighbour below
  cv::Mat radius;           // of the window [px]
  cv::Mat slope_x, value;   // of the line fitted along the row
  cv::Mat slope_confidence; // sum of squared distances that slope_x rests on

  explicit Planes(const cv::Size& size)
  : inverse_depth(paddedImage(size)), link_right(paddedImage(size)), link_down(paddedImage(size)),
    radius(paddedImage(size)), slope_x(paddedImage(size)), value(paddedImage(size)),
    slope_confidence(paddedImage(size))
  {
  }
};

/** Radius with which noise turns a normal by NORMAL_SIGMA: a window of radius r
 * determines a slope to sigma / sqrt(n var), n = (2r+1)^2 pixels, var = r(r+1)/3 their
 * spread. */
void
radiusTable(const CameraIntrinsics& camera, std::vector<float>& table)
{
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double z = 0.05 * (double(i) + 0.5);
    const double needed = camera.depth_noise.sigma(z) * camera.fx / (z * NORMAL_SIGMA);
    int r = 2;
    while (r < MAX_RADIUS && (2 * r + 1) * std::sqrt(r * (r + 1) / 3.0) < needed)
      ++r;
    table[i] = float(r);
  }
}

BUNDLE_ICP_INLINE void
prepareRow(const float* z, int width, const std::vector<float>& radii, float* inverse,
           float* radius)
{
  const int last = int(radii.size()) - 1;
  const float* table = radii.data();
#pragma omp simd
  for (int u = 0; u < width; ++u) {
    const float depth = z[u] > 0 ? z[u] : 0.0f, reciprocal = 1 / depth;
    inverse[u] = depth > 0 ? reciprocal : 0.0f;
    const int bin = int(20 * (depth < 100 ? depth : 100.0f));
    radius[u] = table[bin < last ? bin : last];
  }
}

BUNDLE_ICP_INLINE void
linkRows(const float* a, const float* b, int width, DepthEdges linked, float* links)
{
#pragma omp simd
  for (int u = 0; u < width; ++u)
    links[u] = linked(a[u], b[u]);
}

/** Running sums of one arm of the window: how far it reaches, and zeroth and first
 * moment of the differences to the centre. */
struct Arm {
  float open[64], reach[64], sum[64], moment[64];
};

/** Least-squares line through a window that reaches `before` and `after` its centre. */
struct Line {
  float slope, offset, confidence;
};

inline Line
fitLine(float before, float after, float sum, float moment)
{
  const float n = 1 + before + after;
  const float su = 0.5f * (after * (after + 1) - before * (before + 1));
  const float suu =
      (after * (after + 1) * (2 * after + 1) + before * (before + 1) * (2 * before + 1)) *
      (1 / 6.0f);
  const float det = n * suu - su * su;
  const float scale = det > 0 ? 1 / det : 0;
  return {(n * moment - su * sum) * scale, (suu * sum - su * moment) * scale, det / n};
}

/** Lines along a row, in blocks so that the sums stay in registers or the first cache.
 */
BUNDLE_ICP_INLINE void
fitAlongRow(const float* w, const float* link, const float* radius, int width, float* slope,
            float* value, float* confidence)
{
  for (int start = 0; start < width; start += 64) {
    const int n = std::min(64, width - start);
    Arm left = {}, right = {};
    std::fill_n(left.open, 64, 1.0f);
    std::fill_n(right.open, 64, 1.0f);
    const float* c = w + start;
    const float* r = radius + start;
    const float* l = link + start;
    for (int d = 1; d <= MAX_RADIUS; ++d) {
      const float distance = float(d);
#pragma omp simd
      for (int i = 0; i < n; ++i) {
        const float inside = r[i] >= distance ? 1.0f : 0.0f;
        right.open[i] *= l[i + d - 1] * inside;
        left.open[i] *= l[i - d] * inside;
        const float after = right.open[i] * (c[i + d] - c[i]);
        const float before = left.open[i] * (c[i - d] - c[i]);
        right.reach[i] += right.open[i];
        left.reach[i] += left.open[i];
        right.sum[i] += after + before;
        right.moment[i] += distance * (after - before);
      }
    }
#pragma omp simd
    for (int i = 0; i < n; ++i) {
      const Line line = fitLine(left.reach[i], right.reach[i], right.sum[i], right.moment[i]);
      slope[start + i] = line.slope;
      value[start + i] = c[i] + line.offset;
      confidence[start + i] = line.confidence;
    }
  }
}

/** Result of combining the rows' lines down the columns, for one block of a row. */
struct PlaneBlock {
  float slope_x[64], slope_y[64], value[64], known[64];
};

BUNDLE_ICP_INLINE void
fitDownColumns(Planes& planes, int row, int start, int n, PlaneBlock& block)
{
  const std::size_t step = planes.value.step1();
  const float* value = paddedRow(planes.value, row) + start;
  const float* slope = paddedRow(planes.slope_x, row) + start;
  const float* confidence = paddedRow(planes.slope_confidence, row) + start;
  const float* link = paddedRow(planes.link_down, row) + start;
  const float* radius = paddedRow(planes.radius, row) + start;
  Arm up = {}, down = {};
  float slope_sum[64], confidence_sum[64];
#pragma omp simd
  for (int i = 0; i < n; ++i) {
    up.open[i] = down.open[i] = 1;
    slope_sum[i] = confidence[i] * slope[i];
    confidence_sum[i] = confidence[i];
  }
  for (int d = 1; d <= MAX_RADIUS; ++d) {
    const float distance = float(d);
    const std::ptrdiff_t shift = std::ptrdiff_t(step) * d;
    const std::ptrdiff_t link_shift = std::ptrdiff_t(step) * (d - 1);
#pragma omp simd
    for (int i = 0; i < n; ++i) {
      const float inside = radius[i] >= distance ? 1.0f : 0.0f;
      down.open[i] *= link[i + link_shift] * inside;
      up.open[i] *= link[i - shift] * inside;
      const float after = down.open[i] * (value[i + shift] - value[i]);
      const float before = up.open[i] * (value[i - shift] - value[i]);
      down.reach[i] += down.open[i];
      up.reach[i] += up.open[i];
      down.sum[i] += after + before;
      down.moment[i] += distance * (after - before);
      const float c_after = down.open[i] * confidence[i + shift];
      const float c_before = up.open[i] * confidence[i - shift];
      slope_sum[i] += c_after * slope[i + shift] + c_before * slope[i - shift];
      confidence_sum[i] += c_after + c_before;
    }
  }
#pragma omp simd
  for (int i = 0; i < n; ++i) {
    const Line line = fitLine(up.reach[i], down.reach[i], down.sum[i], down.moment[i]);
    block.known[i] = confidence_sum[i] > 0 && line.confidence > 0 ? 1.0f : 0.0f;
    block.slope_x[i] = slope_sum[i] / confidence_sum[i];
    block.slope_y[i] = line.slope;
    block.value[i] = value[i] + line.offset;
  }
}

/** Normals, and the cosine of the angle between normal and ray, of one row. */
BUNDLE_ICP_INLINE void
normalsOfBlock(const PlaneBlock& block, const CameraIntrinsics& camera, int row, int start, int n,
               float* normals, float* cosine)
{
  const float fx = float(camera.fx), fy = float(camera.fy);
  const float y = float((row - camera.cy) / camera.fy);
#pragma omp simd
  for (int i = 0; i < n; ++i) {
    const float x = (float(start + i) - float(camera.cx)) / fx;
    const float a = block.slope_x[i] * fx, b = block.slope_y[i] * fy;
    const float c = block.value[i] - a * x - b * y;
    const float norm = std::sqrt(a * a + b * b + c * c);
    const float scale = block.known[i] > 0 ? -1 / norm : NOT_MEASURED;
    normals[3 * i] = a * scale;
    normals[3 * i + 1] = b * scale;
    normals[3 * i + 2] = c * scale;
    // With inverse depth as the plane, normal * ray is simply the value at the pixel.
    cosine[i] = -block.value[i] * scale / std::sqrt(x * x + y * y + 1);
  }
}

/** Distance of each pixel to the nearest depth edge or hole [px], 0.5 at the edge; 0
 * for a pixel between two edges, which belongs to no surface: a flying pixel. */
cv::Mat
edgeDistance(Planes& planes, const cv::Size& size)
{
  cv::Mat inner(size, CV_8U);
  cv::Mat flying = cv::Mat::zeros(size, CV_8U);
  for (int v = 0; v < size.height; ++v) {
    const float* right = paddedRow(planes.link_right, v);
    const float* down = paddedRow(planes.link_down, v);
    const float* up = paddedRow(planes.link_down, v - 1);
    std::uint8_t* in = inner.ptr(v);
    std::uint8_t* fly = flying.ptr(v);
    const bool top = v == 0, bottom = v == size.height - 1;
    for (int u = 0; u < size.width; ++u) {
      const bool l = u == 0 || right[u - 1] > 0, r = u == size.width - 1 || right[u] > 0;
      const bool t = top || up[u] > 0, b = bottom || down[u] > 0;
      in[u] = l && r && t && b ? 1 : 0;
      fly[u] = (!l && !r) || (!t && !b) ? 1 : 0;
    }
  }
  cv::Mat distance;
  cv::distanceTransform(inner, distance, cv::DIST_L1, 3, CV_32F);
  distance += 0.5f;
  distance.setTo(0, flying);
  return distance;
}

/** Weight of one row: 1 / sigma^2 times cosine of the viewing angle and edge distance.
 */
BUNDLE_ICP_INLINE void
weightsOfRow(const float* z, const float* cosine, const float* distance, int width,
             const VirtualDepthOptions& options, DepthSigma depth_sigma, float* weight)
{
  const float steepest = float(std::cos(options.max_view_angle * M_PI / 180));
  const float ramp = options.edge_distance > 0 ? float(1 / options.edge_distance) : 1e9f;
#pragma omp simd
  for (int u = 0; u < width; ++u) {
    const float sigma = depth_sigma(z[u]);
    const float near_edge = std::min(1.0f, distance[u] * ramp);
    const float w = cosine[u] * near_edge / (sigma * sigma);
    weight[u] = z[u] > 0 && cosine[u] >= steepest ? w : 0.0f;
  }
}

void
prepare(const DepthView& view, int threads, Planes& planes)
{
  std::vector<float> radii(400);
  radiusTable(view.camera, radii);
  const DepthEdges linked(view.camera);
  const int width = view.depth.cols, height = view.depth.rows;
#pragma omp parallel for num_threads(threads) schedule(static)
  for (int v = 0; v < height; ++v) {
    const float* z = view.depth.ptr<float>(v);
    simd::call<prepareRow>(z, width, radii, paddedRow(planes.inverse_depth, v),
                           paddedRow(planes.radius, v));
    simd::call<linkRows>(z, z + 1, width - 1, linked, paddedRow(planes.link_right, v));
    if (v + 1 < height)
      simd::call<linkRows>(z, view.depth.ptr<float>(v + 1), width, linked,
                           paddedRow(planes.link_down, v));
    simd::call<fitAlongRow>(paddedRow(planes.inverse_depth, v), paddedRow(planes.link_right, v),
                            paddedRow(planes.radius, v), width, paddedRow(planes.slope_x, v),
                            paddedRow(planes.value, v), paddedRow(planes.slope_confidence, v));
  }
}

void
fillNormalsAndWeights(DepthView& view, const VirtualDepthOptions& options)
{
  const cv::Size size = view.depth.size();
  const int threads = resolveThreads(options.num_threads);
  Planes planes(size);
  prepare(view, threads, planes);
  const cv::Mat distance = edgeDistance(planes, size);
  view.normals.create(size, CV_32FC3);
  view.weight.create(size, CV_32F);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (int v = 0; v < size.height; ++v) {
    std::vector<float> cosine(std::size_t(size.width));
    for (int start = 0; start < size.width; start += 64) {
      const int n = std::min(64, size.width - start);
      PlaneBlock block;
      simd::call<fitDownColumns>(planes, v, start, n, block);
      simd::call<normalsOfBlock>(block, view.camera, v, start, n,
                                 view.normals.ptr<float>(v) + 3 * start, cosine.data() + start);
    }
    simd::call<weightsOfRow>(view.depth.ptr<float>(v), cosine.data(), distance.ptr<float>(v),
                             size.width, options, DepthSigma(view.camera.depth_noise),
                             view.weight.ptr<float>(v));
  }
}

} // namespace

DepthView
makeDepthView(const cv::Mat& depth, const CameraIntrinsics& camera, int reduction,
              const VirtualDepthOptions& options)
{
  DepthView view;
  view.depth = reduceDepth(depth, camera, reduction, options);
  view.camera = reduction > 1 ? camera.undistorted().reduced(reduction) : camera.undistorted();
  fillNormalsAndWeights(view, options);
  return view;
}

} // namespace bundle_icp
