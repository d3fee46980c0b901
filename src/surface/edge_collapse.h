// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "surface/mesh_editing.h"

#include <bundle_icp/surface/mesh_decimation.h>

#include <Eigen/Dense>
#include <limits>
#include <queue>
#include <vector>

namespace bundle_icp {

/** Sum of squared distances to planes, weighted: x' A x + 2 b' x + c. */
struct Quadric {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  /** Adds the plane through `point` with unit `normal`. */
  void
  addPlane(const Eigen::Vector3d& normal, const Eigen::Vector3d& point, double weight);

  Quadric&
  operator+=(const Quadric& other);

  double
  operator()(const Eigen::Vector3d& x) const
  {
    return x.dot(a * x + 2 * b) + c;
  }
};

/** Distance of a point to a triangle, squared. */
double
squaredDistance(const Eigen::Vector3d& point,
                const Eigen::Vector3d& a,
                const Eigen::Vector3d& b,
                const Eigen::Vector3d& c);

/** A mesh whose edges are collapsed one by one. Each vertex of the original mesh stays attached to
 *  the nearest of the triangles that took the place of its own, so that its distance to the mesh
 *  is known at any time. Vertices are those of the mesh, relative to its middle for precision. */
class EdgeCollapse {
public:
  explicit EdgeCollapse(SurfaceMesh& mesh);

  /** Collapses until `options` are met or no edge is left that may be. */
  void
  run(const MeshDecimationOptions& options);

  /** Squared distance of each original vertex to the mesh, at most [m^2]. */
  const std::vector<double>&
  squaredErrors() const
  {
    return point_error_;
  }

  /** Puts what is left into the mesh. */
  void
  finish();

private:
  static constexpr std::uint32_t NONE = std::numeric_limits<std::uint32_t>::max();

  /** An edge at the time when it was judged; outdated when one of its ends has changed. */
  struct Candidate {
    double cost;
    std::uint32_t a, b; ///< a < b
    std::uint32_t version_a, version_b;

    bool
    operator<(const Candidate& other) const // of a queue that gives the largest
    {
      return cost != other.cost ? cost > other.cost
                                : a != other.a ? a > other.a : b > other.b;
    }
  };

  /** What a collapse would do, found out before it is done. */
  struct Plan {
    std::uint32_t keep, drop;
    Eigen::Vector3d position;
    std::vector<std::uint32_t> removed;   ///< triangles at the edge
    std::vector<std::uint32_t> remaining; ///< all others around its ends
    std::vector<std::uint32_t> moved;     ///< of these, those at `drop`
    std::vector<std::uint32_t> points;    ///< attached to any of them
    std::vector<std::uint32_t> new_triangle; ///< of each point
    std::vector<double> new_error;
    double boundary_error; ///< of `keep`, see boundary_error_
  };

  void
  sumQuadrics();
  void
  push(std::uint32_t a, std::uint32_t b);
  Eigen::Vector3d
  bestPosition(std::uint32_t a, std::uint32_t b, const Quadric& quadric) const;
  bool
  plan(const Candidate& candidate, double max_error);
  bool
  collectTriangles();
  bool
  keepsTopology();
  bool
  keepsShape() const;
  bool
  keepsBoundary(double max_error);
  bool
  attachPoints(double max_error);
  void
  apply();
  void
  blendAttributes(double share);

  /** Corner of a triangle after the planned collapse. */
  const Eigen::Vector3d&
  planned(std::uint32_t triangle, int i) const
  {
    const std::uint32_t vertex = mesh_.triangles[triangle][i];
    return vertex == plan_.keep || vertex == plan_.drop ? plan_.position : position_[vertex];
  }

  bool
  isAlive(std::uint32_t triangle) const
  {
    return mesh_.triangles[triangle][0] != NONE;
  }

  /** Calls visit(triangle) for those around a vertex. */
  template <typename Visit>
  void
  forEachAround(std::uint32_t vertex, const Visit& visit) const
  {
    for (std::uint32_t corner = first_corner_[vertex]; corner != NONE; corner = next_corner_[corner])
      if (isAlive(corner / 3))
        visit(corner / 3);
  }

  SurfaceMesh& mesh_;
  Eigen::Vector3d middle_;
  std::vector<Eigen::Vector3d> position_;
  std::vector<Quadric> quadric_;
  std::vector<std::uint8_t> is_boundary_; // of vertices
  std::vector<double> boundary_error_;    // how far the boundary there may have moved [m]
  std::vector<std::uint32_t> version_;    // of vertices: how often they have changed
  std::vector<std::uint32_t> first_corner_, last_corner_, next_corner_; // lists by vertex
  std::vector<std::uint32_t> first_point_, next_point_;                 // lists by triangle
  std::vector<double> point_error_;
  std::vector<Eigen::Vector3d> point_; // the original vertices
  std::vector<std::uint32_t> mark_;    // of vertices: the last question in which they occurred
  std::uint32_t question_ = 0;
  std::size_t num_triangles_;
  std::priority_queue<Candidate> queue_;
  Plan plan_;
};

} // namespace bundle_icp
