// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mesh/mesh_editing.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace bundle_icp {

/** The vertices of a mesh before it changes, each attached to one of the triangles after, with its
 *  squared distance to that: a list for each triangle. */
class AttachedPoints {
public:
  /** Attaches each vertex to the first of its own triangles. */
  AttachedPoints(const std::vector<Eigen::Vector3d>& vertices, const HalfEdges& half_edges,
                 std::size_t num_triangles)
  : position_(vertices), error_(vertices.size(), 0), first_(num_triangles, NONE),
    next_(vertices.size(), NONE)
  {
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
      std::uint32_t triangle = NONE;
      half_edges.forEachLeaving(v, [&](std::uint32_t h) { triangle = std::min(triangle, h / 3); });
      attach(v, triangle, 0);
    }
  }

  const Eigen::Vector3d&
  position(std::uint32_t point) const
  {
    return position_[point];
  }

  /** Appends the points of a triangle. */
  void
  collect(std::uint32_t triangle, std::vector<std::uint32_t>& points) const
  {
    for (std::uint32_t p = first_[triangle]; p != NONE; p = next_[p])
      points.push_back(p);
  }

  /** Leaves a triangle without points; each of them is to be attached again. */
  void
  detach(std::uint32_t triangle)
  {
    first_[triangle] = NONE;
  }

  void
  attach(std::uint32_t point, std::uint32_t triangle, double squared_distance)
  {
    error_[point] = squared_distance;
    next_[point] = std::exchange(first_[triangle], point);
  }

  /** The squared distance of each point. */
  std::vector<double>
  takeErrors()
  {
    return std::move(error_);
  }

private:
  static constexpr std::uint32_t NONE = UINT32_MAX;

  std::vector<Eigen::Vector3d> position_;
  std::vector<double> error_;
  std::vector<std::uint32_t> first_, next_;
};

} // namespace bundle_icp
