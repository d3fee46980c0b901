// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mesh/mesh_editing.h"

#include <Eigen/Core>

#include <vector>

namespace bundle_icp {

/** What collapses of edges cost, by the squared distances to the planes of the triangles that each
 *  vertex stands for (Garland and Heckbert, SIGGRAPH 1997). */
class VertexQuadrics {
public:
  /** \param positions of the vertices; they must outlive this, and may move */
  VertexQuadrics(const std::vector<Triangle>& triangles, const HalfEdges& half_edges,
                 const std::vector<Eigen::Vector3d>& positions);

  bool
  isBoundary(std::uint32_t vertex) const
  {
    return is_boundary_[vertex];
  }

  /** Where the quadric of both is least: on boundaries one of the ends, elsewhere anywhere near. */
  Eigen::Vector3d
  bestPosition(std::uint32_t a, std::uint32_t b) const;

  /** The quadric of both there. */
  double
  cost(std::uint32_t a, std::uint32_t b) const;

  /** `keep` stands for what `drop` stood for, too. */
  void
  merge(std::uint32_t keep, std::uint32_t drop);

private:
  /** Sum of squared distances to planes, weighted: [x 1] Q [x 1]'. */
  using Quadric = Eigen::Matrix4d;

  static Quadric
  planeQuadric(const Eigen::Vector3d& normal, const Eigen::Vector3d& point, double weight);
  static double
  errorAt(const Quadric& quadric, const Eigen::Vector3d& point);

  const std::vector<Eigen::Vector3d>& position_;
  std::vector<Quadric> quadric_;
  std::vector<std::uint8_t> is_boundary_;
};

} // namespace bundle_icp
