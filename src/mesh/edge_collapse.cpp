// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/edge_collapse.h"

#include "mesh/mesh_editing.h"

#include <Eigen/Dense>

#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>

// Not pcl::MeshQuadricDecimationVTK: VTK stays out of the library, and it states no error.
// Not meshoptimizer 0.18: within the same largest deviation it leaves seven to nine times as many
// triangles, and edges with more than two. Not OpenMesh 9: its ModHausdorff takes fourteen times as
// long and lets boundaries shrink.
namespace bundle_icp {
namespace {

constexpr std::uint32_t NONE = std::numeric_limits<std::uint32_t>::max();
/** Cosine of the largest angle by which a collapse may turn a triangle. */
constexpr double MIN_TURN_COSINE = 0.2;
/** Minimum height over longest edge of a triangle after a collapse. */
constexpr double NARROW = 0.01;

/** Sum of squared distances to planes, weighted: [x 1] Q [x 1]'. */
using Quadric = Eigen::Matrix4d;

Quadric
planeQuadric(const Eigen::Vector3d& normal, const Eigen::Vector3d& point, double weight)
{
  const Eigen::Vector4d plane(normal.x(), normal.y(), normal.z(), -normal.dot(point));
  return weight * plane * plane.transpose();
}

double
errorAt(const Quadric& quadric, const Eigen::Vector3d& point)
{
  return point.homogeneous().dot(quadric * point.homogeneous());
}

/** A mesh whose edges are collapsed one by one. Each vertex of the original mesh stays attached to
 *  the nearest of the triangles that took the place of its own, so that its distance to the mesh
 *  is known at any time. Vertices are those of the mesh, relative to its middle for precision. */
class EdgeCollapse {
public:
  EdgeCollapse(SurfaceMesh& mesh, double max_error)
  : mesh_(mesh), half_edges_(mesh.triangles, mesh.vertices.size()), max_error_(max_error),
    middle_(Eigen::Vector3d::Zero()), position_(mesh.vertices.size()),
    quadric_(mesh.vertices.size(), Quadric::Zero()), is_boundary_(mesh.vertices.size(), false),
    boundary_error_(mesh.vertices.size(), 0), version_(mesh.vertices.size(), 0),
    merged_(mesh.vertices.size(), NONE), last_merged_(mesh.vertices.size()),
    first_point_(mesh.triangles.size(), NONE), next_point_(mesh.vertices.size(), NONE),
    point_error_(mesh.vertices.size(), 0), num_triangles_(mesh.triangles.size())
  {
    for (const Eigen::Vector3f& vertex : mesh.vertices)
      middle_ += vertex.cast<double>() / double(mesh.vertices.size());
    for (std::uint32_t v = 0; v < position_.size(); ++v) {
      position_[v] = mesh.vertices[v].cast<double>() - middle_;
      last_merged_[v] = v;
      std::uint32_t triangle = NONE;
      half_edges_.forEachLeaving(v, [&](std::uint32_t h) { triangle = std::min(triangle, h / 3); });
      next_point_[v] = std::exchange(first_point_[triangle], v);
    }
    point_ = position_;
    sumQuadrics();
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
    return std::move(point_error_);
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
    Vertices ring_keep, ring_drop; ///< around both ends, see ring()
    Triangles removed;             ///< at the edge
    Triangles remaining;           ///< all others around its ends
    Triangles moved;               ///< of these, those at `drop`
    Vertices points;               ///< attached to any of them
    Triangles new_triangle;        ///< of each point
    std::vector<double> new_error;
    double boundary_error; ///< of `keep`, see boundary_error_
  };

  void
  sumQuadrics()
  {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Eigen::Vector3d normal = normalOf(t);
      for (const std::uint32_t vertex : mesh_.triangles[t])
        quadric_[vertex] += planeQuadric(normal.normalized(), position_[vertex], normal.norm() / 6);
    }
    // A boundary is held by planes through it, across the surface.
    half_edges_.forEachEdge([&](const std::uint32_t* first, const std::uint32_t* last) {
      for (const std::uint32_t* h = first; h != last && last - first != 2; ++h) {
        const std::uint32_t a = half_edges_.from(*h), b = half_edges_.to(*h);
        const Eigen::Vector3d along = position_[b] - position_[a];
        const Eigen::Vector3d across = along.cross(normalOf(*h / 3)).normalized();
        for (const std::uint32_t vertex : {a, b}) {
          quadric_[vertex] += planeQuadric(across, position_[a], along.squaredNorm());
          is_boundary_[vertex] = true;
        }
      }
    });
    half_edges_.forEachEdge([&](const std::uint32_t* first, const std::uint32_t*) {
      push(half_edges_.from(*first), half_edges_.to(*first));
    });
  }

  void
  push(std::uint32_t a, std::uint32_t b)
  {
    if (a > b)
      std::swap(a, b);
    const Quadric sum = quadric_[a] + quadric_[b];
    const double cost = std::max(0.0, errorAt(sum, bestPosition(a, b, sum)));
    queue_.push({cost, a, b, version_[a], version_[b]});
  }

  /** Place where the quadric is least: on boundaries one of the ends, elsewhere anywhere near. */
  Eigen::Vector3d
  bestPosition(std::uint32_t a, std::uint32_t b, const Quadric& quadric) const
  {
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

  bool
  plan(const Candidate& candidate)
  {
    plan_.keep = candidate.a;
    plan_.drop = candidate.b;
    if (version_[plan_.keep] != candidate.version_a || version_[plan_.drop] != candidate.version_b)
      return false;
    plan_.position =
        bestPosition(plan_.keep, plan_.drop, quadric_[plan_.keep] + quadric_[plan_.drop]);
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
        (is_boundary_[plan_.keep] && is_boundary_[plan_.drop] && count == 2))
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
        around += normalOf(t);
    return std::all_of(plan_.remaining.begin(), plan_.remaining.end(), [&](std::uint32_t t) {
      const auto& [v0, v1, v2] = mesh_.triangles[t];
      const Eigen::Vector3d &a = planned(v0), &b = planned(v1), &c = planned(v2);
      const Eigen::Vector3d before = normalOf(t), after = (b - a).cross(c - a);
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
    return max_error_ == 0 || plan_.boundary_error <= max_error_;
  }

  /** Finds the nearest of the remaining triangles for each point attached to those around. */
  bool
  attachPoints()
  {
    plan_.points.clear();
    plan_.new_triangle.clear();
    plan_.new_error.clear();
    const double limit = max_error_ > 0 ? max_error_ * max_error_ : INFINITY;
    for (const auto* triangles : {&plan_.removed, &plan_.remaining})
      for (const std::uint32_t t : *triangles)
        for (std::uint32_t p = first_point_[t]; p != NONE; p = next_point_[p])
          plan_.points.push_back(p);
    for (const std::uint32_t p : plan_.points) {
      std::pair<double, std::uint32_t> nearest(INFINITY, NONE);
      for (const std::uint32_t t : plan_.remaining) {
        const auto& [a, b, c] = mesh_.triangles[t];
        const double d = squaredDistance(point_[p], planned(a), planned(b), planned(c));
        if (d < nearest.first)
          nearest = {d, t};
      }
      if (!(nearest.first <= limit))
        return false;
      plan_.new_error.push_back(nearest.first);
      plan_.new_triangle.push_back(nearest.second);
    }
    return true;
  }

  void
  apply()
  {
    const std::uint32_t keep = plan_.keep, drop = plan_.drop;
    const Eigen::Vector3d edge = position_[drop] - position_[keep];
    const double share = edge.dot(plan_.position - position_[keep]) / edge.squaredNorm();
    blendAttributes(std::clamp(share, 0.0, 1.0)); // NaN, of an edge without length, stays 0
    position_[keep] = plan_.position;
    quadric_[keep] += quadric_[drop];
    is_boundary_[keep] |= is_boundary_[drop];
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
        first_point_[t] = NONE;
    for (std::size_t i = 0; i < plan_.points.size(); ++i) {
      const std::uint32_t p = plan_.points[i];
      point_error_[p] = plan_.new_error[i];
      next_point_[p] = std::exchange(first_point_[plan_.new_triangle[i]], p);
    }
    ++version_[keep];
    ++version_[drop];
    ring(keep, plan_.ring_keep);
    const auto end = std::unique(plan_.ring_keep.begin(), plan_.ring_keep.end());
    std::for_each(plan_.ring_keep.begin(), end, [&](std::uint32_t vertex) { push(keep, vertex); });
  }

  /** Moves the attributes of `keep` towards those of `drop`. */
  void
  blendAttributes(double share)
  {
    const std::uint32_t keep = plan_.keep, drop = plan_.drop;
    const auto s = static_cast<float>(share);
    const auto blend = [s](float a, float b) { return (1 - s) * a + s * b; };
    if (!mesh_.normals.empty()) {
      const Eigen::Vector3f normal = (1 - s) * mesh_.normals[keep] + s * mesh_.normals[drop];
      if (normal.squaredNorm() > 0)
        mesh_.normals[keep] = normal.normalized();
    }
    if (!mesh_.colors.empty())
      for (int i = 0; i < 3; ++i)
        mesh_.colors[keep][i] = static_cast<std::uint8_t>(
            std::lround(blend(mesh_.colors[keep][i], mesh_.colors[drop][i])));
    for (auto* list : {&mesh_.weights, &mesh_.deviations})
      if (!list->empty())
        (*list)[keep] = blend((*list)[keep], (*list)[drop]);
  }

  Eigen::Vector3d
  normalOf(std::uint32_t triangle) const
  {
    const auto& [a, b, c] = mesh_.triangles[triangle];
    return (position_[b] - position_[a]).cross(position_[c] - position_[a]);
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
  std::vector<Quadric> quadric_;
  std::vector<std::uint8_t> is_boundary_; // of vertices
  std::vector<double> boundary_error_;    // how far the boundary there may have moved [m]
  std::vector<std::uint32_t> version_;    // of vertices: how often they have changed
  Vertices merged_, last_merged_;         // lists of the vertices that became one
  Vertices first_point_, next_point_;     // lists by triangle
  std::vector<double> point_error_;
  std::vector<Eigen::Vector3d> point_; // the original vertices
  std::size_t num_triangles_;
  std::priority_queue<Candidate> queue_;
  Plan plan_;
};

} // namespace

// Ericson, Real-time collision detection, 2005, section 5.1.5: by the region of the triangle's
// plane that the point lies above.
double
squaredDistance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                const Eigen::Vector3d& c)
{
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = point - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0)
    return ap.squaredNorm();
  const Eigen::Vector3d bp = point - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3)
    return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0)
    return (ap - d1 / (d1 - d3) * ab).squaredNorm();
  const Eigen::Vector3d cp = point - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6)
    return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0)
    return (ap - d2 / (d2 - d6) * ac).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6)
    return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).squaredNorm();
  const double sum = va + vb + vc;
  return (ap - vb / sum * ab - vc / sum * ac).squaredNorm();
}

std::vector<double>
collapseEdges(SurfaceMesh& mesh, const MeshDecimationOptions& options)
{
  EdgeCollapse collapse(mesh, options.max_error);
  collapse.run(options.max_triangles);
  return collapse.finish();
}

} // namespace bundle_icp
