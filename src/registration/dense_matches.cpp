// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/dense_matches.h"

#include "common/depth_sigma.h"
#include "common/parallel.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Points that one thread at a time matches. */
constexpr std::size_t CHUNK = 4096;

/** Everything that matching one chunk by projection reads. */
struct Projection {
  float image[3][4]; // homogeneous pixel of a source point
  float world[3][4]; // position about the centre
  float center[3];
  float max_squared, min_cosine;
  float misalignment_squared;
  DepthSigma depth_sigma;
  int width, height;

  Projection(const TargetGrid& target, const Pose& pose, const Eigen::Vector3d& about,
             const MatchTolerance& tolerance)
  : max_squared(std::min(3e38f, tolerance.max_distance * tolerance.max_distance)), min_cosine(0.6f),
    misalignment_squared(tolerance.misalignment * tolerance.misalignment),
    depth_sigma(target.camera.depth_noise), width(target.camera.width), height(target.camera.height)
  {
    const CameraIntrinsics& camera = target.camera;
    Eigen::Matrix3d k;
    k << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
    const Pose virtual_from_source = target.world_from_virtual.inverse() * pose;
    const Eigen::Matrix<double, 3, 4> p = k * virtual_from_source.matrix().topRows<3>();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 4; ++j)
        image[i][j] = float(p(i, j));
      for (int j = 0; j < 3; ++j)
        world[i][j] = float(pose.linear()(i, j));
      world[i][3] = float(pose.translation()[i] - about[i]);
      center[i] = float(about[i]);
    }
  }
};

BUNDLE_ICP_INLINE float
transformed(const float row[4], float x, float y, float z)
{
  return row[0] * x + row[1] * y + row[2] * z + row[3];
}

/** Moves the points and finds the target pixel that each projects to, -1 outside. */
BUNDLE_ICP_INLINE void
project(const Projection& projection, const SourcePoints& s, std::size_t begin, std::size_t end,
        Matches& m)
{
  const Projection p = projection; // a copy, which no store below can change
  const float *sx = s.x.data(), *sy = s.y.data(), *sz = s.z.data();
  const float right = float(p.width), bottom = float(p.height);
#pragma omp simd
  for (std::size_t i = begin; i < end; ++i) {
    const float x = sx[i], y = sy[i], z = sz[i];
    m.px[i] = transformed(p.world[0], x, y, z);
    m.py[i] = transformed(p.world[1], x, y, z);
    m.pz[i] = transformed(p.world[2], x, y, z);
    const float c = transformed(p.image[2], x, y, z);
    const float u = transformed(p.image[0], x, y, z) / c + 0.5f;
    const float v = transformed(p.image[1], x, y, z) / c + 0.5f;
    const bool inside = (c > 0.01f) & (u >= 0) & (v >= 0) & (u < right) & (v < bottom);
    const float u_inside = inside ? u : 0.0f, v_inside = inside ? v : 0.0f;
    const int pixel = int(v_inside) * p.width + int(u_inside);
    m.target[i] = inside ? pixel : -1;
    const float sigma = p.depth_sigma(z);
    m.inverse_sigma[i] = 1 / std::sqrt(sigma * sigma + p.misalignment_squared);
  }
}

void
rejectMatch(Matches& m, std::size_t i)
{
  m.target[i] = -1;
  m.inverse_sigma[i] = m.residual[i] = m.px[i] = m.py[i] = m.pz[i] = 0;
  m.nx[i] = m.ny[i] = m.nz[i] = 0;
  m.sx[i] = m.sy[i] = m.sz[i] = 0;
}

/** Reads the matched target points; keeps pairs that are close and face the same way.
 */
void
gather(const Projection& p, const PointsView& target, const SourcePoints& s, std::size_t begin,
       std::size_t end, Matches& m)
{
  const bool has_normals = !s.nx.empty();
  constexpr std::size_t ahead = 16; // points, about as long as memory takes
  for (std::size_t i = begin; i < end; ++i) {
    if (i + ahead < end && m.target[i + ahead] >= 0)
      __builtin_prefetch(target.xyz + std::size_t(m.target[i + ahead]) * target.stride);
    if (m.target[i] < 0) {
      rejectMatch(m, i);
      continue;
    }
    const std::size_t offset = std::size_t(m.target[i]) * target.stride;
    const float *q = target.xyz + offset, *n = target.normals + offset;
    const float dx = m.px[i] - (q[0] - p.center[0]), dy = m.py[i] - (q[1] - p.center[1]),
                dz = m.pz[i] - (q[2] - p.center[2]);
    const float squared = dx * dx + dy * dy + dz * dz;
    const float residual = dx * n[0] + dy * n[1] + dz * n[2];
    // Written so that NaN in point or normal fails.
    bool keep = squared <= p.max_squared && std::abs(residual) < 3e38f;
    float turned[3] = {n[0], n[1], n[2]};
    if (keep && has_normals) {
      for (int k = 0; k < 3; ++k)
        turned[k] = p.world[k][0] * s.nx[i] + p.world[k][1] * s.ny[i] + p.world[k][2] * s.nz[i];
      keep = n[0] * turned[0] + n[1] * turned[1] + n[2] * turned[2] >= p.min_cosine;
    }
    if (!keep) {
      rejectMatch(m, i);
      continue;
    }
    m.residual[i] = residual;
    m.nx[i] = n[0];
    m.ny[i] = n[1];
    m.nz[i] = n[2];
    m.sx[i] = turned[0];
    m.sy[i] = turned[1];
    m.sz[i] = turned[2];
  }
}

/** Median of the values in (0, limit) by a histogram, unset without any. */
double
histogramMedian(const std::vector<std::size_t>& bins, double bin_width)
{
  std::size_t total = 0, below = 0;
  for (const std::size_t count : bins)
    total += count;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    if (2 * (below + bins[b]) >= total && bins[b] > 0)
      return bin_width * (double(b) + (0.5 * double(total) - double(below)) / double(bins[b]));
    below += bins[b];
  }
  return 0;
}

} // namespace

void
Matches::resize(std::size_t size)
{
  // Whole lane blocks: the padding has no match and weighs nothing.
  const std::size_t padded = (size + LANES - 1) / LANES * LANES;
  for (std::vector<float>* v :
       {&px, &py, &pz, &nx, &ny, &nz, &sx, &sy, &sz, &residual, &inverse_sigma})
    v->assign(padded, 0.0f);
  target.assign(padded, -1);
}

void
matchByProjection(const AlignmentProblem& problem, const TargetGrid& target,
                  const SourcePoints& source, const Pose& pose, const Eigen::Vector3d& center,
                  const MatchTolerance& tolerance, Matches& matches)
{
  // All entries are written: clearing those of the last iteration would be for the padding alone.
  if (matches.size() < source.size() || matches.size() >= source.size() + Matches::LANES)
    matches.resize(source.size());
  for (std::size_t i = source.size(); i < matches.size(); ++i)
    rejectMatch(matches, i);
  const Projection projection(target, pose, center, tolerance);
  const std::size_t chunks = (source.size() + CHUNK - 1) / CHUNK;
#pragma omp parallel for num_threads(resolveThreads(problem.num_threads)) schedule(static)
  for (std::size_t c = 0; c < chunks; ++c) {
    const std::size_t begin = c * CHUNK, end = std::min(source.size(), begin + CHUNK);
    simd::call<project>(projection, source, begin, end, matches);
    gather(projection, target.points, source, begin, end, matches);
  }
}

double
robustScale(const Matches& matches)
{
  std::vector<std::size_t> bins(4000);
  const float *residual = matches.residual.data(), *inverse_sigma = matches.inverse_sigma.data();
  float largest = 0;
#pragma omp simd reduction(max : largest)
  for (std::size_t i = 0; i < matches.size(); ++i)
    largest = std::max(largest, std::abs(residual[i] * inverse_sigma[i]));
  const double width = std::max(1e-12, double(largest) / 3999);
  const float to_bin = float(1 / width);
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (matches.inverse_sigma[i] > 0) {
      const float e = std::abs(matches.residual[i] * matches.inverse_sigma[i]) * to_bin;
      ++bins[std::min<std::size_t>(bins.size() - 1, std::size_t(e))];
    }
  return 1.4826 * histogramMedian(bins, width);
}

Meeting
meetingByProjection(const TargetGrid& target, const SourcePoints& source, const Pose& pose,
                    const Matches& matches, double scale)
{
  const Pose virtual_from_world = target.world_from_virtual.inverse();
  const CameraIntrinsics& camera = target.camera;
  Meeting meeting;
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (matches.target[i] >= 0 &&
        std::abs(double(matches.residual[i] * matches.inverse_sigma[i])) <= 3 * scale) {
      meeting.near += 1;
      continue;
    }
    const Eigen::Vector3d p =
        virtual_from_world * (pose * Eigen::Vector3d(source.x[i], source.y[i], source.z[i]));
    if (!(p.z() > 0))
      continue;
    const Eigen::Vector2d pixel = camera.project(p).array().round();
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width &&
          pixel.y() < camera.height))
      continue;
    const auto index = std::size_t(pixel.y() * camera.width + pixel.x());
    const Eigen::Vector3f seen =
        Eigen::Map<const Eigen::Vector3f>(target.points.xyz + index * target.points.stride);
    if (const double z = (virtual_from_world * seen.cast<double>()).z(); std::isfinite(z))
      meeting.against += p.z() < z ? 2 : 1;
  }
  return meeting;
}

double
rmsError(const Matches& matches)
{
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (matches.inverse_sigma[i] > 0) {
      const double e = double(matches.residual[i] * matches.inverse_sigma[i]);
      sum += e * e;
      count += 1;
    }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

} // namespace bundle_icp
