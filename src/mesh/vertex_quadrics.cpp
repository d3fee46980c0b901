// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/vertex_quadrics.h"

#include <Eigen/Dense>

#include <algorithm>

namespace bundle_icp {

VertexQuadrics::VertexQuadrics(const std::vector<Triangle>& triangles, const HalfEdges& half_edges,
                               const std::vector<Eigen::Vector3d>& positions)
: position_(positions), quadric_(positions.size(), Quadric::Zero()),
  is_boundary_(positions.size(), false)
{
  for (const Triangle& triangle : triangles) {
    const Eigen::Vector3d normal = areaNormal(positions, triangle);
    for (const std::uint32_t vertex : triangle)
      quadric_[vertex] += planeQuadric(normal.normalized(), positions[vertex], normal.norm() / 6);
  }
  // A boundary is held by planes through it, across the surface.
  half_edges.forEachEdge([&](const std::uint32_t* first, const std::uint32_t* last) {
    for (const std::uint32_t* h = first; h != last && last - first != 2; ++h) {
      const std::uint32_t a = half_edges.from(*h), b = half_edges.to(*h);
      const Eigen::Vector3d along = positions[b] - positions[a];
      const Eigen::Vector3d across =
          along.cross(areaNormal(positions, triangles[*h / 3])).normalized();
      for (const std::uint32_t vertex : {a, b}) {
        quadric_[vertex] += planeQuadric(across, positions[a], along.squaredNorm());
        is_boundary_[vertex] = true;
      }
    }
  });
}

Eigen::Vector3d
VertexQuadrics::bestPosition(std::uint32_t a, std::uint32_t b) const
{
  const Quadric quadric = quadric_[a] + quadric_[b];
  const Eigen::Vector3d &pa = position_[a], &pb = position_[b];
  if (is_boundary_[a] != is_boundary_[b])
    return is_boundary_[a] ? pa : pb;
  if (is_boundary_[a])
    return errorAt(quadric, pa) <= errorAt(quadric, pb) ? pa : pb;
  // Where planes leave a direction open, a weak pull to the middle decides.
  const Eigen::Vector3d middle = (pa + pb) / 2;
  Eigen::Matrix3d left = quadric.topLeftCorner<3, 3>();
  const double pull = 1e-3 * left.trace() + 1e-30;
  left.diagonal().array() += pull;
  const Eigen::Vector3d best = left.ldlt().solve(pull * middle - quadric.topRightCorner<3, 1>());
  const bool is_near = (best - middle).squaredNorm() < 4 * (pb - pa).squaredNorm(); // not NaN
  return is_near ? best : middle;
}

double
VertexQuadrics::cost(std::uint32_t a, std::uint32_t b) const
{
  return std::max(0.0, errorAt(quadric_[a] + quadric_[b], bestPosition(a, b)));
}

void
VertexQuadrics::merge(std::uint32_t keep, std::uint32_t drop)
{
  quadric_[keep] += quadric_[drop];
  is_boundary_[keep] |= is_boundary_[drop];
}

VertexQuadrics::Quadric
VertexQuadrics::planeQuadric(const Eigen::Vector3d& normal, const Eigen::Vector3d& point,
                             double weight)
{
  const Eigen::Vector4d plane(normal.x(), normal.y(), normal.z(), -normal.dot(point));
  return weight * plane * plane.transpose();
}

double
VertexQuadrics::errorAt(const Quadric& quadric, const Eigen::Vector3d& point)
{
  return point.homogeneous().dot(quadric * point.homogeneous());
}

} // namespace bundle_icp
