// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/edge_collapse.h"

#include "mesh/attached_points.h"
#include "mesh/mesh_editing.h"
#include "mesh/triangle_distance.h"
#include "mesh/vertex_quadrics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

// Not pcl::MeshQuadricDecimationVTK: VTK stays out of the library, and it states no error.
// Not meshoptimizer 0.18: within the same largest deviation it leaves seven to nine times as many
// triangles, and edges with more than two. Not OpenMesh 9: its ModHausdorff takes fourteen times as
// long and lets boundaries shrink.
namespace bundle_icp {
namespace {

constexpr std::uint32_t NONE = UINT32_MAX;
/** Cosine of the largest angle by which a collapse may turn a triangle. */
constexpr double MIN_TURN_COSINE = 0.2;
/** Minimum height over longest edge of a triangle after a collapse. */
constexpr double NARROW = 0.01;

Eigen::Vector3d
middleOf(const SurfaceMesh& mesh)
{
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    middle += vertex.cast<double>() / double(mesh.vertices.size());
  return middle;
}

std::vector<Eigen::Vector3d>
relativeTo(const Eigen::Vector3d& middle, const SurfaceMesh& mesh)
{
  std::vector<Eigen::Vector3d> positions(mesh.vertices.size());
  for (std::size_t v = 0; v < positions.size(); ++v)
    positions[v] = mesh.vertices[v].cast<double>() - middle;
  return positions;
}

/** A mesh whose edges are collapsed one by one. Each vertex of the original mesh stays attached to
 *  the nearest of the triangles that took the place of its own, so that its distance to the mesh
 *  is known at any time. Vertices are those of the mesh, relative to its middle for precision. */
class EdgeCollapse {
public:
  EdgeCollapse(SurfaceMesh& mesh, double max_error)
  : mesh_(mesh), half_edges_(mesh.triangles, mesh.vertices.size()),
    max_error_(max_error > 0 ? max_error : INFINITY), middle_(middleOf(mesh)),
    position_(relativeTo(middle_, mesh)), quadrics_(mesh.triangles, half_edges_, position_),
    boundary_error_(mesh.vertices.size(), 0), version_(mesh.vertices.size(), 0),
    merged_(mesh.vertices.size(), NONE), last_merged_(mesh.vertices.size()),
    points_(position_, half_edges_, mesh.triangles.size()), num_triangles_(mesh.triangles.size())
  {
    std::iota(last_merged_.begin(), last_merged_.end(), 0);
    half_edges_.forEachEdge([&](const std::uint32_t* first, const std::uint32_t*) {
      push(half_edges_.from(*first), half_edges_.to(*first));
    });
  }

  void
  run(std::size_t max_triangles)
  {
    while (!queue_.empty() && num_triangles_ > max_triangles) {
      const Candidate candidate = queue_.top();
      queue_.pop();
      if (plan(candidate))
        apply();
    }
  }

  /** Writes the remaining triangles into the mesh. \return the squared error of each original
   *  vertex. */
  std::vector<double>
  finish()
  {
    for (std::size_t v = 0; v < position_.size(); ++v)
      mesh_.vertices[v] = (position_[v] + middle_).cast<float>();
    std::vector<std::uint8_t> keep(mesh_.triangles.size());
    for (std::uint32_t t = 0; t < keep.size(); ++t)
      keep[t] = isAlive(t);
    keepTriangles(mesh_, keep);
    removeUnusedVertices(mesh_);
    return points_.takeErrors();
  }

private:
  using Vertices = std::vector<std::uint32_t>;
  using Triangles = std::vector<std::uint32_t>;

  /** An edge at the time of its evaluation; outdated when one of its ends has changed. */
  struct Candidate {
    double cost;
    std::uint32_t a, b; ///< a < b
    std::uint32_t version_a, version_b;

    bool
    operator<(const Candidate& other) const // of a queue that gives the largest
    {
      return std::tie(other.cost, other.a, other.b) < std::tie(cost, a, b);
    }
  };

  /** Result of a collapse, computed before the collapse. */
  struct Plan {
    std::uint32_t keep, drop;
    Eigen::Vector3d position;
    Vertices ring_keep, ring_drop;                         ///< around both ends, see ring()
    Triangles removed;                                     ///< at the edge
    Triangles remaining;                                   ///< all others around its ends
    Triangles moved;                                       ///< of these, those at `drop`
    Vertices points;                                       ///< attached to any of them
    std::vector<std::pair<double, std::uint32_t>> nearest; ///< squared distance, triangle of each
    double boundary_error;                                 ///< of `keep`, see boundary_error_
  };

  void
  push(std::uint32_t a, std::uint32_t b)
  {
    if (a > b)
      std::swap(a, b);
    queue_.push({quadrics_.cost(a, b), a, b, version_[a], version_[b]});
  }

  bool
  plan(const Candidate& candidate)
  {
    plan_.keep = candidate.a;
    plan_.drop = candidate.b;
    if (version_[plan_.keep] != candidate.version_a || version_[plan_.drop] != candidate.version_b)
      return false;
    plan_.position = quadrics_.bestPosition(plan_.keep, plan_.drop);
    collectTriangles();
    return keepsTopology() && keepsShape() && keepsBoundary() && attachPoints();
  }

  void
  collectTriangles()
  {
    for (auto* triangles : {&plan_.removed, &plan_.remaining, &plan_.moved})
      triangles->clear();
    const auto has = [this](std::uint32_t t, std::uint32_t vertex) {
      const Triangle& corners = mesh_.triangles[t];
      return std::find(corners.begin(), corners.end(), vertex) != corners.end();
    };
    forEachAround(plan_.keep, [&](std::uint32_t t) {
      (has(t, plan_.drop) ? plan_.removed : plan_.remaining).push_back(t);
    });
    forEachAround(plan_.drop, [&](std::uint32_t t) {
      if (!has(t, plan_.keep))
        plan_.moved.push_back(t);
    });
    plan_.remaining.insert(plan_.remaining.end(), plan_.moved.begin(), plan_.moved.end());
    ring(plan_.keep, plan_.ring_keep);
    ring(plan_.drop, plan_.ring_drop);
  }

  /** Link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999): the ends have no neighbours in common
   *  but the corners opposite to the edge, which is one of a boundary where both ends are. */
  bool
  keepsTopology() const
  {
    const std::size_t count = plan_.removed.size();
    if (count == 0 || count > 2 || plan_.remaining.empty() ||
        (quadrics_.isBoundary(plan_.keep) && quadrics_.isBoundary(plan_.drop) && count == 2))
      return false;
    Vertices common;
    std::set_intersection(plan_.ring_keep.begin(), plan_.ring_keep.end(), plan_.ring_drop.begin(),
                          plan_.ring_drop.end(), std::back_inserter(common));
    common.erase(std::unique(common.begin(), common.end()), common.end());
    // A triangle of `drop` with both opposite corners would fall onto one of `keep`.
    return common.size() == count &&
           std::none_of(plan_.moved.begin(), plan_.moved.end(), [&](std::uint32_t t) {
             const Triangle& corners = mesh_.triangles[t];
             return std::count_if(corners.begin(), corners.end(), [&](std::uint32_t vertex) {
                      return vertex == common.front() || vertex == common.back();
                    }) == 2;
           });
  }

  /** True when no triangle turns over or becomes narrower than the bound or its old shape. */
  bool
  keepsShape() const
  {
    const auto shape = [](double double_area, const auto& a, const auto& b, const auto& c) {
      return double_area /
             std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    };
    Eigen::Vector3d around = Eigen::Vector3d::Zero();
    for (const auto* triangles : {&plan_.removed, &plan_.remaining})
      for (const std::uint32_t t : *triangles)
        around += areaNormal(position_, mesh_.triangles[t]);
    return std::all_of(plan_.remaining.begin(), plan_.remaining.end(), [&](std::uint32_t t) {
      const auto& [v0, v1, v2] = mesh_.triangles[t];
      const Eigen::Vector3d &a = planned(v0), &b = planned(v1), &c = planned(v2);
      const Eigen::Vector3d before = areaNormal(position_, mesh_.triangles[t]),
                            after = (b - a).cross(c - a);
      const double shape_before = shape(before.norm(), position_[v0], position_[v1], position_[v2]);
      // A narrow triangle's own normal says little.
      const Eigen::Vector3d& reference = shape_before < NARROW ? around : before;
      return shape(after.norm(), a, b, c) >= std::min(NARROW, shape_before) && after.norm() > 0 &&
             reference.dot(after) >= MIN_TURN_COSINE * reference.norm() * after.norm();
    });
  }

  /** The corner that a boundary loses when two of its vertices become one must lie near the edge
   *  that takes its place: points inside a surface do not notice when it grows over a hole. */
  bool
  keepsBoundary()
  {
    plan_.boundary_error = std::max(boundary_error_[plan_.keep], boundary_error_[plan_.drop]);
    if (plan_.removed.size() != 1)
      return true;
    const bool stays = plan_.position == position_[plan_.keep];
    const std::uint32_t lost = stays ? plan_.drop : plan_.keep;
    const Vertices& around = stays ? plan_.ring_drop : plan_.ring_keep;
    double nearest = INFINITY;
    for (const std::uint32_t vertex : around)
      if (vertex != plan_.keep && vertex != plan_.drop &&
          std::count(around.begin(), around.end(), vertex) == 1) {
        const Eigen::Vector3d& end = position_[vertex];
        nearest = std::min(nearest, squaredDistance(position_[lost], plan_.position, end, end));
      }
    plan_.boundary_error += std::sqrt(nearest);
    return plan_.boundary_error <= max_error_;
  }

  /** Finds the nearest of the remaining triangles for each point attached to those around. */
  bool
  attachPoints()
  {
    plan_.points.clear();
    plan_.nearest.clear();
    for (const auto* triangles : {&plan_.removed, &plan_.remaining})
      for (const std::uint32_t t : *triangles)
        points_.collect(t, plan_.points);
    for (const std::uint32_t p : plan_.points) {
      std::pair<double, std::uint32_t> nearest(INFINITY, NONE);
      for (const std::uint32_t t : plan_.remaining) {
        const auto& [a, b, c] = mesh_.triangles[t];
        const double d = squaredDistance(points_.position(p), planned(a), planned(b), planned(c));
        if (d < nearest.first)
          nearest = {d, t};
      }
      if (!(nearest.first <= max_error_ * max_error_))
        return false;
      plan_.nearest.push_back(nearest);
    }
    return true;
  }

  void
  apply()
  {
    const std::uint32_t keep = plan_.keep, drop = plan_.drop;
    const Eigen::Vector3d edge = position_[drop] - position_[keep];
    const double share = edge.dot(plan_.position - position_[keep]) / edge.squaredNorm();
    blendAttributes(mesh_, keep, drop, share > 0 ? std::min(share, 1.0) : 0); // NaN without length
    position_[keep] = plan_.position;
    quadrics_.merge(keep, drop);
    boundary_error_[keep] = plan_.boundary_error;
    for (const std::uint32_t t : plan_.moved)
      std::replace(mesh_.triangles[t].begin(), mesh_.triangles[t].end(), drop, keep);
    for (const std::uint32_t t : plan_.removed)
      mesh_.triangles[t][0] = NONE;
    num_triangles_ -= plan_.removed.size();
    merged_[last_merged_[keep]] = drop;
    last_merged_[keep] = last_merged_[drop];
    for (const auto* triangles : {&plan_.removed, &plan_.remaining})
      for (const std::uint32_t t : *triangles)
        points_.detach(t);
    for (std::size_t i = 0; i < plan_.points.size(); ++i)
      points_.attach(plan_.points[i], plan_.nearest[i].second, plan_.nearest[i].first);
    ++version_[keep];
    ++version_[drop];
    ring(keep, plan_.ring_keep);
    const auto end = std::unique(plan_.ring_keep.begin(), plan_.ring_keep.end());
    std::for_each(plan_.ring_keep.begin(), end, [&](std::uint32_t vertex) { push(keep, vertex); });
  }

  /** Place of a vertex after the planned collapse. */
  const Eigen::Vector3d&
  planned(std::uint32_t vertex) const
  {
    return vertex == plan_.keep || vertex == plan_.drop ? plan_.position : position_[vertex];
  }

  bool
  isAlive(std::uint32_t triangle) const
  {
    return mesh_.triangles[triangle][0] != NONE;
  }

  /** Calls visit(triangle) for those around a vertex: its own and those of all merged with it. */
  template <typename Visit>
  void
  forEachAround(std::uint32_t vertex, const Visit& visit) const
  {
    for (; vertex != NONE; vertex = merged_[vertex])
      half_edges_.forEachLeaving(vertex, [&](std::uint32_t h) {
        if (isAlive(h / 3))
          visit(h / 3);
      });
  }

  /** The vertices around one, sorted: twice each, but once where a boundary ends there. */
  void
  ring(std::uint32_t vertex, Vertices& around) const
  {
    around.clear();
    forEachAround(vertex, [&](std::uint32_t t) {
      for (const std::uint32_t other : mesh_.triangles[t])
        if (other != vertex)
          around.push_back(other);
    });
    std::sort(around.begin(), around.end());
  }

  SurfaceMesh& mesh_;
  const HalfEdges half_edges_; // as they were in the beginning
  const double max_error_;
  Eigen::Vector3d middle_;
  std::vector<Eigen::Vector3d> position_;
  VertexQuadrics quadrics_;
  std::vector<double> boundary_error_; // how far the boundary there may have moved [m]
  std::vector<std::uint32_t> version_; // of vertices: how often they have changed
  Vertices merged_, last_merged_;      // lists of the vertices that became one
  AttachedPoints points_;              // the original vertices
  std::size_t num_triangles_;
  std::priority_queue<Candidate> queue_;
  Plan plan_;
};

} // namespace

std::vector<double>
collapseEdges(SurfaceMesh& mesh, const MeshDecimationOptions& options)
{
  EdgeCollapse collapse(mesh, options.max_error);
  collapse.run(options.max_triangles);
  return collapse.finish();
}

} // namespace bundle_icp
