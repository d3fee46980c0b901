// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "merge_views.h"

#include "common/depth_sigma.h"
#include "common/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

/** A surface in front counts only with this share of the weight of what is seen behind
 * it. */
constexpr float MIN_WEIGHT_SHARE = 0.1f;
/** Depth of a sample that shows nothing [m]: finite, so that sums stay free of NaN. */
constexpr float FAR_AWAY = 1e6f;

inline float
larger(float a, float b)
{
  return a > b ? a : b;
}

/** Samples that one view contributes to a row of the virtual image. */
struct RowSamples {
  std::vector<float> inverse, depth, weight, nx, ny, nz;

  explicit RowSamples(std::size_t width)
      : inverse(width), depth(width), weight(width), nx(width), ny(width), nz(width)
  {
  }
};

/** Weighted sums over the samples of the nearest surface. */
struct RowSums {
  std::vector<float> front, weight, depth, nx, ny, nz, behind;

  explicit RowSums(std::size_t width)
      : front(width), weight(width), depth(width), nx(width), ny(width), nz(width),
        behind(width)
  {
  }
};

/** Copies what the samples of a row say of their surface. Apart from the arithmetic, whose
 *  vectors would be filled by gather instructions, slower than these loads. */
void
fetchRow(const Contribution& from, int row, int width, RowSamples& out)
{
  const WarpedPixel* pixels =
      from.warped.data() + static_cast<std::ptrdiff_t>(row) * width;
  const cv::Vec3f* normals = from.view->normals.ptr<cv::Vec3f>();
  const float* weights = from.view->weight.ptr<float>();
  float *inverse = out.inverse.data(), *weight = out.weight.data();
  float *nx = out.nx.data(), *ny = out.ny.data(), *nz = out.nz.data();
  // All views together are more streams than the processor looks ahead of, hence the hints
  // for the next row.
  const int next = from.view->depth.cols;
  for (int u = 0; u < width; ++u) {
    const int pixel = pixels[u].source;
    __builtin_prefetch(weights + pixel + next);
    __builtin_prefetch(normals + pixel + next);
    __builtin_prefetch(pixels + u + width);
    inverse[u] = pixels[u].inverse_depth;
    weight[u] = weights[pixel];
    nx[u] = normals[pixel][0];
    ny[u] = normals[pixel][1];
    nz[u] = normals[pixel][2];
  }
}

/** The measured depth moves a point along the view's ray. How far this moves the
 * surface along the virtual ray, and so its weight there, depends on how both meet it.
 *  `out` has what fetchRow() put there. */
BUNDLE_ICP_SIMD void
sampleRow(const Contribution& from, const CameraIntrinsics& camera, int row,
          RowSamples& out)
{
  const float* inverse = out.inverse.data();
  const Eigen::Matrix3f& R = from.rotation;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), r10 = R(1, 0), r11 = R(1, 1),
              r12 = R(1, 2), r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  const float ox = from.center.x(), oy = from.center.y(), oz = from.center.z();
  const float y = static_cast<float>((row - camera.cy) / camera.fy);
  const float cx = static_cast<float>(camera.cx),
              scale = static_cast<float>(1 / camera.fx);
  float *depth = out.depth.data(), *weight = out.weight.data();
  float *nx = out.nx.data(), *ny = out.ny.data(), *nz = out.nz.data();
#pragma omp simd
  for (int u = 0; u < camera.width; ++u) {
    // Loaded whether needed or not: a loop without branches is one for vector
    // instructions.
    const float inverse_z = inverse[u], full_weight = weight[u];
    const float a = nx[u], b = ny[u], c = nz[u];
    const float x = (static_cast<float>(u) - cx) * scale;
    const float divisor = inverse_z > 0 ? inverse_z : 1.0f;
    const float z = 1 / divisor;
    const float n0 = r00 * a + r01 * b + r02 * c;
    const float n1 = r10 * a + r11 * b + r12 * c;
    const float n2 = r20 * a + r21 * b + r22 * c;
    const float along_virtual = n0 * x + n1 * y + n2;
    const float px = z * x - ox, py = z * y - oy, pz = z - oz; // from the view's centre
    const float view_depth = r02 * px + r12 * py + r22 * pz;
    const float along_view = (n0 * px + n1 * py + n2 * pz) / view_depth;
    const float ratio = along_virtual / along_view;
    const float gain = ratio < 2 ? ratio : 2.0f;
    const float facing = larger(along_virtual, along_view);
    const bool seen = (inverse_z > 0) & (facing < 0);
    const float scaled = full_weight * gain * gain;
    depth[u] = seen ? z : FAR_AWAY;
    weight[u] = seen ? scaled : 0.0f;
    nx[u] = seen ? n0 : 0.0f;
    ny[u] = seen ? n1 : 0.0f;
    nz[u] = seen ? n2 : 0.0f;
  }
}

/** Sums the samples within `reach` of the nearest one, in columns begin to end. */
BUNDLE_ICP_SIMD void
sumNearest(const std::vector<RowSamples>& samples, DepthSigma reach, int begin, int end,
           RowSums& sums)
{
  float *front = sums.front.data(), *weight = sums.weight.data(),
        *depth = sums.depth.data();
  float *nx = sums.nx.data(), *ny = sums.ny.data(), *nz = sums.nz.data();
  float* behind = sums.behind.data();
#pragma omp simd
  for (int u = begin; u < end; ++u) {
    front[u] = FAR_AWAY;
    weight[u] = depth[u] = nx[u] = ny[u] = nz[u] = behind[u] = 0;
  }
  for (const RowSamples& s : samples) {
    const float* z = s.depth.data();
#pragma omp simd
    for (int u = begin; u < end; ++u)
      front[u] = z[u] < front[u] ? z[u] : front[u];
  }
  for (const RowSamples& s : samples) {
    const float *z = s.depth.data(), *w = s.weight.data();
    const float *sx = s.nx.data(), *sy = s.ny.data(), *sz = s.nz.data();
#pragma omp simd
    for (int u = begin; u < end; ++u) {
      const float step = z[u] - front[u];
      const bool same = step <= reach(front[u]);
      const float all = w[u];
      const float used = same ? all : 0.0f;
      weight[u] += used;
      depth[u] += used * step;
      nx[u] += used * sx[u];
      ny[u] += used * sy[u];
      nz[u] += used * sz[u];
      behind[u] += all - used;
    }
  }
}

/** Removes the nearest surface from one column: hardly any weight says that it exists.
 */
void
removeFront(std::vector<RowSamples>& samples, const DepthSigma& reach, int column,
            float front)
{
  const std::size_t u = static_cast<std::size_t>(column);
  for (RowSamples& s : samples)
    if (s.depth[u] - front <= reach(front)) {
      s.depth[u] = FAR_AWAY;
      s.weight[u] = 0;
    }
}

void
writeRow(const RowSums& sums, int row, VirtualDepth& out)
{
  float* depth = out.depth.ptr<float>(row);
  float* variance = out.variance.ptr<float>(row);
  cv::Vec3f* normals = out.normals.ptr<cv::Vec3f>(row);
  constexpr float NOT_SEEN = std::numeric_limits<float>::quiet_NaN();
  for (int column = 0; column < out.camera.width; ++column) {
    const std::size_t u = static_cast<std::size_t>(column);
    const bool seen = sums.weight[u] > 0;
    const float scale = seen ? 1 / sums.weight[u] : NOT_SEEN;
    const float x = sums.nx[u], y = sums.ny[u], z = sums.nz[u];
    const float norm = seen ? 1 / std::sqrt(x * x + y * y + z * z) : NOT_SEEN;
    depth[column] = sums.front[u] + sums.depth[u] * scale;
    variance[column] = scale;
    normals[column] = cv::Vec3f(x * norm, y * norm, z * norm);
  }
}

} // namespace

void
mergeViews(const std::vector<Contribution>& contributions,
           const VirtualDepthOptions& options, VirtualDepth& out)
{
  const int width = out.camera.width;
  const DepthSigma reach(out.camera.depth_noise, options.merge_sigmas * std::sqrt(2.0));
#pragma omp parallel num_threads(resolveThreads(options.num_threads))
  {
    std::vector<RowSamples> samples(contributions.size(),
                                    RowSamples(static_cast<std::size_t>(width)));
    RowSums sums(static_cast<std::size_t>(width));
#pragma omp for schedule(static)
    for (int row = 0; row < out.camera.height; ++row) {
      for (std::size_t i = 0; i < contributions.size(); ++i) {
        fetchRow(contributions[i], row, width, samples[i]);
        sampleRow(contributions[i], out.camera, row, samples[i]);
      }
      sumNearest(samples, reach, 0, width, sums);
      for (int u = 0; u < width; ++u) {
        const std::size_t c = static_cast<std::size_t>(u);
        while (sums.weight[c] < MIN_WEIGHT_SHARE * sums.behind[c]) {
          removeFront(samples, reach, u, sums.front[c]);
          sumNearest(samples, reach, u, u + 1, sums);
        }
      }
      writeRow(sums, row, out);
    }
  }
}

} // namespace bundle_icp
