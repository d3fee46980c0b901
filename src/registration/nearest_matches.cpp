// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/nearest_matches.h"

#include "common/parallel.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

constexpr int NEIGHBOURS = 12;
/** A neighbourhood is planar when at most this share of its variance is off the plane.
 */
constexpr float MAX_OFF_PLANE = 0.05f;
/** Normals that differ by more than 53 degrees belong to different surfaces. */
constexpr float MIN_COSINE = 0.6f;

Eigen::Vector3f
pointAt(const PointsView& view, int index)
{
  return Eigen::Map<const Eigen::Vector3f>(view.xyz + std::size_t(index) * view.stride);
}

} // namespace

NearestMatcher::NearestMatcher(const AlignmentProblem& problem) : problem_(problem)
{
  if (problem.target.normals)
    return;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  normals_.assign(problem.target.size, Eigen::Vector3f::Constant(nan));
  known_.assign(problem.target.size, 0);
}

void
NearestMatcher::findNearest(const SourcePoints& source, const Pose& pose,
                            const Eigen::Vector3d& center, float max_distance, Matches& m) const
{
  const Eigen::Matrix3d rotation = pose.linear();
  const float limit = std::min(std::numeric_limits<float>::max(), max_distance * max_distance);
#pragma omp parallel num_threads(resolveThreads(problem_.num_threads))
  {
    std::vector<int> nearest;
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < source.size(); ++i) {
      const Eigen::Vector3d p =
          rotation * Eigen::Vector3d(source.x[i], source.y[i], source.z[i]) + pose.translation();
      const Eigen::Vector3f query = p.cast<float>();
      problem_.nearest(query.data(), 1, nearest);
      const bool found =
          !nearest.empty() && (pointAt(problem_.target, nearest[0]) - query).squaredNorm() <= limit;
      const Eigen::Vector3d relative = p - center;
      m.px[i] = float(relative.x());
      m.py[i] = float(relative.y());
      m.pz[i] = float(relative.z());
      m.target[i] = found ? nearest[0] : -1;
    }
  }
}

Eigen::Vector3f
NearestMatcher::fitNormal(int target) const
{
  std::vector<int> indices;
  const Eigen::Vector3f at = pointAt(problem_.target, target);
  problem_.nearest(at.data(), NEIGHBOURS, indices);
  const Eigen::Vector3f unknown =
      Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  if (indices.size() < 5)
    return unknown;
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const int i : indices)
    mean += (pointAt(problem_.target, i) - at) / float(indices.size());
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
  for (const int i : indices) {
    const Eigen::Vector3f d = pointAt(problem_.target, i) - at - mean;
    covariance += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> eigen(covariance);
  const float total = covariance.trace();
  // A line has no normal, a volume neither.
  if (!(total > 0) || eigen.eigenvalues()[0] > MAX_OFF_PLANE * total ||
      eigen.eigenvalues()[1] < MAX_OFF_PLANE * total)
    return unknown;
  return eigen.eigenvectors().col(0);
}

void
NearestMatcher::prepareNormals(const std::vector<int>& targets)
{
  std::vector<int> wanted;
  for (const int t : targets)
    if (t >= 0 && !known_[std::size_t(t)]) {
      known_[std::size_t(t)] = 1;
      wanted.push_back(t);
    }
#pragma omp parallel for num_threads(resolveThreads(problem_.num_threads)) schedule(static)
  for (std::size_t i = 0; i < wanted.size(); ++i)
    normals_[std::size_t(wanted[i])] = fitNormal(wanted[i]);
  std::size_t matched = 0, planar = 0;
  for (const int t : targets)
    if (t >= 0) {
      ++matched;
      planar += normals_[std::size_t(t)].allFinite() ? 1 : 0;
    }
  planar_ = planar_ && 2 * planar >= matched;
}

void
NearestMatcher::fillPlanes(const SourcePoints& source, const Pose& pose,
                           const Eigen::Vector3d& center, Matches& m) const
{
  const bool own = normals_.empty();
  const Eigen::Matrix3f rotation = pose.linear().cast<float>();
  const Eigen::Vector3f about = center.cast<float>();
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (m.target[i] < 0)
      continue;
    const std::size_t t = std::size_t(m.target[i]);
    const Eigen::Vector3f n = own ? Eigen::Vector3f(Eigen::Map<const Eigen::Vector3f>(
                                        problem_.target.normals + t * problem_.target.stride))
                                  : normals_[t];
    bool keep = n.allFinite();
    Eigen::Vector3f turned = n;
    if (keep && own && !source.nx.empty()) {
      turned = rotation * Eigen::Vector3f(source.nx[i], source.ny[i], source.nz[i]);
      keep = n.dot(turned) >= MIN_COSINE;
    }
    if (!keep) {
      m.target[i] = -1;
      continue;
    }
    const Eigen::Vector3f q = pointAt(problem_.target, m.target[i]) - about;
    m.residual[i] = n.dot(Eigen::Vector3f(m.px[i], m.py[i], m.pz[i]) - q);
    m.nx[i] = n.x();
    m.ny[i] = n.y();
    m.nz[i] = n.z();
    m.sx[i] = turned.x();
    m.sy[i] = turned.y();
    m.sz[i] = turned.z();
    m.inverse_sigma[i] = 1;
  }
}

void
NearestMatcher::fillPoints(std::size_t size, const Eigen::Vector3d& center, Matches& m) const
{
  Matches axes;
  axes.resize(3 * size);
  const Eigen::Vector3f about = center.cast<float>();
  for (std::size_t i = 0; i < size; ++i) {
    if (m.target[i] < 0)
      continue;
    const Eigen::Vector3f p(m.px[i], m.py[i], m.pz[i]);
    const Eigen::Vector3f d = p - (pointAt(problem_.target, m.target[i]) - about);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t k = i + axis * size;
      axes.px[k] = p.x();
      axes.py[k] = p.y();
      axes.pz[k] = p.z();
      (axis == 0 ? axes.nx : axis == 1 ? axes.ny : axes.nz)[k] = 1;
      (axis == 0 ? axes.sx : axis == 1 ? axes.sy : axes.sz)[k] = 1;
      axes.residual[k] = d[Eigen::Index(axis)];
      axes.inverse_sigma[k] = 1;
      axes.target[k] = m.target[i];
    }
  }
  m = std::move(axes);
}

void
NearestMatcher::match(const SourcePoints& source, const Pose& pose, const Eigen::Vector3d& center,
                      float max_distance, Matches& matches)
{
  matches.resize(source.size());
  findNearest(source, pose, center, max_distance, matches);
  if (!problem_.target.normals && planar_)
    prepareNormals(matches.target);
  if (planar_)
    fillPlanes(source, pose, center, matches);
  else
    fillPoints(source.size(), center, matches);
}

Meeting
NearestMatcher::meeting(const SourcePoints& source, const Matches& m,
                        const Eigen::Vector3d& center) const
{
  constexpr std::size_t num_ring = 5; // the point and its four neighbours
  const Eigen::Vector3f about = center.cast<float>();
  std::size_t near = 0, against = 0;
#pragma omp parallel num_threads(resolveThreads(problem_.num_threads)) reduction(+ : near, against)
  {
    std::vector<int> ring;
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < source.size(); ++i) {
      if (m.target[i] < 0)
        continue;
      const Eigen::Vector3f q = pointAt(problem_.target, m.target[i]);
      problem_.nearest(q.data(), num_ring, ring);
      if (ring.size() < num_ring) // so few points are no surface to be near to
        continue;
      const float limit = 2 * (pointAt(problem_.target, ring.back()) - q).norm();
      const float distance = (Eigen::Vector3f(m.px[i], m.py[i], m.pz[i]) + about - q).norm();
      near += distance <= limit ? 1 : 0;
      against += distance > limit && distance <= 3 * limit ? 1 : 0;
    }
  }
  return {double(near), 3 * double(against)};
}

} // namespace bundle_icp
