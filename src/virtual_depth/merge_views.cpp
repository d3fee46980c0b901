// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "virtual_depth/merge_views.h"

#include "common/depth_sigma.h"
#include "common/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

/** Minimum weight of a surface in front, as a share of the weight of the surface behind it. */
constexpr float MIN_WEIGHT_SHARE = 0.1f;
/** Depth of a sample that shows nothing [m]: finite, so that sums stay free of NaN. */
constexpr float FAR_AWAY = 1e6f;

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
  : front(width), weight(width), depth(width), nx(width), ny(width), nz(width), behind(width)
  {
  }
};

/** Copies the samples of a row. Kept apart from the arithmetic, whose vectors would need gather
 *  instructions, which are slower than these loads. */
void
fetchRow(const Contribution& from, int row, int width, RowSamples& out)
{
  const WarpedPixel* pixels = from.warped.data() + std::ptrdiff_t(row) * width;
  const cv::Vec3f* normals = from.view->normals.ptr<cv::Vec3f>();
  const float* weights = from.view->weight.ptr<float>();
  // All views together are more streams than the processor looks ahead of, hence the hints
  // for the next row.
  const int next = from.view->depth.cols;
  for (int u = 0; u < width; ++u) {
    const int pixel = pixels[u].source;
    __builtin_prefetch(weights + pixel + next);
    __builtin_prefetch(normals + pixel + next);
    __builtin_prefetch(pixels + u + width);
    out.inverse[u] = pixels[u].inverse_depth;
    out.weight[u] = weights[pixel];
    out.nx[u] = normals[pixel][0];
    out.ny[u] = normals[pixel][1];
    out.nz[u] = normals[pixel][2];
  }
}

/** viewTerm() for a whole row; `out` has what fetchRow() put there. */
BUNDLE_ICP_INLINE void
sampleRow(const Contribution& from, const CameraIntrinsics& camera, int row, RowSamples& out)
{
  const Eigen::Matrix3f& R = from.rotation;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), r10 = R(1, 0), r11 = R(1, 1),
              r12 = R(1, 2), r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  const float ox = from.center.x(), oy = from.center.y(), oz = from.center.z();
  const float y = float((row - camera.cy) / camera.fy);
  const float cx = float(camera.cx), scale = float(1 / camera.fx);
#pragma omp simd
  for (int u = 0; u < camera.width; ++u) {
    // Loaded whether needed or not: a loop without branches is one for vector
    // instructions.
    const float inverse_z = out.inverse[u], full_weight = out.weight[u];
    const float a = out.nx[u], b = out.ny[u], c = out.nz[u];
    const float x = (float(u) - cx) * scale;
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
    const float facing = simd::larger(along_virtual, along_view);
    const bool seen = (inverse_z > 0) & (facing < 0);
    const float scaled = full_weight * gain * gain;
    out.depth[u] = seen ? z : FAR_AWAY;
    out.weight[u] = seen ? scaled : 0.0f;
    out.nx[u] = seen ? n0 : 0.0f;
    out.ny[u] = seen ? n1 : 0.0f;
    out.nz[u] = seen ? n2 : 0.0f;
  }
}

/** Sums the samples within `reach` of the nearest one. */
BUNDLE_ICP_INLINE void
sumNearest(const std::vector<RowSamples>& samples, DepthSigma reach, int width, RowSums& sums)
{
#pragma omp simd
  for (int u = 0; u < width; ++u) {
    sums.front[u] = FAR_AWAY;
    sums.weight[u] = sums.depth[u] = sums.nx[u] = sums.ny[u] = sums.nz[u] = sums.behind[u] = 0;
  }
  for (const RowSamples& s : samples)
#pragma omp simd
    for (int u = 0; u < width; ++u)
      sums.front[u] = s.depth[u] < sums.front[u] ? s.depth[u] : sums.front[u];
  for (const RowSamples& s : samples)
#pragma omp simd
    for (int u = 0; u < width; ++u) {
      const float step = s.depth[u] - sums.front[u];
      const bool same = step <= reach(sums.front[u]);
      const float all = s.weight[u];
      const float used = same ? all : 0.0f;
      sums.weight[u] += used;
      sums.depth[u] += used * step;
      sums.nx[u] += used * s.nx[u];
      sums.ny[u] += used * s.ny[u];
      sums.nz[u] += used * s.nz[u];
      sums.behind[u] += all - used;
    }
}

/** The views' terms in one column, with the nearest surface in `sums`. */
ViewTerm
mergeColumn(const std::vector<RowSamples>& samples, const RowSums& sums, std::size_t u,
            DepthSigma reach)
{
  if (sums.weight[u] >= MIN_WEIGHT_SHARE * sums.behind[u])
    return {sums.front[u] + sums.depth[u] * (1 / sums.weight[u]),
            sums.weight[u],
            {sums.nx[u], sums.ny[u], sums.nz[u]}};
  std::vector<ViewTerm> terms;
  for (const RowSamples& s : samples)
    terms.push_back({s.depth[u], s.weight[u], {s.nx[u], s.ny[u], s.nz[u]}});
  return virtualDepthAt(terms, reach);
}

void
writeRow(const std::vector<RowSamples>& samples, const RowSums& sums, int row, DepthSigma reach,
         VirtualDepth& out)
{
  float* depth = out.depth.ptr<float>(row);
  float* variance = out.variance.ptr<float>(row);
  cv::Vec3f* normals = out.normals.ptr<cv::Vec3f>(row);
  constexpr float NOT_SEEN = std::numeric_limits<float>::quiet_NaN();
  for (int u = 0; u < out.camera.width; ++u) {
    const ViewTerm merged = mergeColumn(samples, sums, std::size_t(u), reach);
    const bool seen = merged.w > 0;
    const float x = merged.normal.x(), y = merged.normal.y(), z = merged.normal.z();
    const float norm = seen ? 1 / std::sqrt(x * x + y * y + z * z) : NOT_SEEN;
    depth[u] = seen ? merged.D : NOT_SEEN;
    variance[u] = seen ? 1 / merged.w : NOT_SEEN;
    normals[u] = cv::Vec3f(x * norm, y * norm, z * norm);
  }
}

} // namespace

ViewTerm
viewTerm(const Contribution& from, const CameraIntrinsics& camera, int u, int v)
{
  const WarpedPixel& pixel = from.warped[std::size_t(v * camera.width + u)];
  if (!(pixel.inverse_depth > 0))
    return {};
  const Eigen::Vector3f ray = camera.unproject(u, v, 1).cast<float>();
  const Eigen::Vector3f X = ray / pixel.inverse_depth, X_i = X - from.center;
  const float* const normal = from.view->normals.ptr<float>() + 3 * pixel.source;
  const Eigen::Vector3f n = from.rotation * Eigen::Map<const Eigen::Vector3f>(normal);
  const float along_virtual = n.dot(ray), along_view = n.dot(X_i) / X_i.dot(from.rotation.col(2));
  if (!(std::max(along_virtual, along_view) < 0))
    return {}; // seen from behind
  const float gain = std::min(along_virtual / along_view, 2.0f);
  return {X.z(), from.view->weight.ptr<float>()[pixel.source] * gain * gain, n};
}

ViewTerm
virtualDepthAt(std::vector<ViewTerm> terms, DepthSigma reach)
{
  while (true) {
    float nearest = FAR_AWAY;
    for (const ViewTerm& term : terms)
      nearest = term.w > 0 ? std::min(nearest, term.D) : nearest;
    const float limit = reach(nearest);
    ViewTerm sum;
    float behind = 0;
    for (ViewTerm& term : terms) {
      if (term.D - nearest > limit) {
        behind += term.w;
        continue;
      }
      sum.D += term.w * (term.D - nearest);
      sum.normal += term.w * term.normal;
      sum.w += term.w;
      term.w = 0; // gone, should hardly any weight say that this surface exists
    }
    sum.D = nearest + sum.D * (1 / sum.w);
    if (sum.w >= MIN_WEIGHT_SHARE * behind)
      return sum;
  }
}

void
mergeViews(const std::vector<Contribution>& contributions, const VirtualDepthOptions& options,
           VirtualDepth& out)
{
  const int width = out.camera.width;
  const std::size_t columns = std::size_t(width);
  const DepthSigma reach(out.camera.depth_noise, options.merge_sigmas * std::sqrt(2.0));
#pragma omp parallel num_threads(resolveThreads(options.num_threads))
  {
    std::vector<RowSamples> samples(contributions.size(), RowSamples(columns));
    RowSums sums(columns);
#pragma omp for schedule(static)
    for (int row = 0; row < out.camera.height; ++row) {
      for (std::size_t i = 0; i < contributions.size(); ++i) {
        fetchRow(contributions[i], row, width, samples[i]);
        simd::call<sampleRow>(contributions[i], out.camera, row, samples[i]);
      }
      simd::call<sumNearest>(samples, reach, width, sums);
      writeRow(samples, sums, row, reach, out);
    }
  }
}

} // namespace bundle_icp
