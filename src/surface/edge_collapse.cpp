// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/edge_collapse.h"

#include <cmath>

namespace bundle_icp {
namespace {

/** Cosine of the largest angle by which a collapse may turn a triangle. */
constexpr double MIN_TURN_COSINE = 0.2;
/** Height over longest edge that a collapse may leave a triangle with. */
constexpr double NARROW = 0.01;

} // namespace

void
Quadric::addPlane(const Eigen::Vector3d& normal, const Eigen::Vector3d& point, double weight)
{
  const double offset = -normal.dot(point);
  a += weight * normal * normal.transpose();
  b += weight * offset * normal;
  c += weight * offset * offset;
}

Quadric&
Quadric::operator+=(const Quadric& other)
{
  a += other.a;
  b += other.b;
  c += other.c;
  return *this;
}

// Ericson, Real-time collision detection, 2005, section 5.1.5: by the region of the triangle's
// plane that the point lies above.
double
squaredDistance(const Eigen::Vector3d& point,
                const Eigen::Vector3d& a,
                const Eigen::Vector3d& b,
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

EdgeCollapse::EdgeCollapse(SurfaceMesh& mesh)
: mesh_(mesh), middle_(Eigen::Vector3d::Zero()), position_(mesh.vertices.size()),
  quadric_(mesh.vertices.size()), is_boundary_(mesh.vertices.size(), false),
  boundary_error_(mesh.vertices.size(), 0),
  version_(mesh.vertices.size(), 0), first_corner_(mesh.vertices.size(), NONE),
  last_corner_(mesh.vertices.size(), NONE), next_corner_(3 * mesh.triangles.size(), NONE),
  first_point_(mesh.triangles.size(), NONE), next_point_(mesh.vertices.size(), NONE),
  point_error_(mesh.vertices.size(), 0), mark_(mesh.vertices.size(), 0),
  num_triangles_(mesh.triangles.size())
{
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    middle_ += vertex.cast<double>() / double(mesh.vertices.size());
  for (std::size_t i = 0; i < position_.size(); ++i)
    position_[i] = mesh.vertices[i].cast<double>() - middle_;
  point_ = position_;
  for (std::uint32_t h = 0; h < next_corner_.size(); ++h) {
    const std::uint32_t vertex = mesh.triangles[h / 3][h % 3];
    if (first_corner_[vertex] == NONE) {
      first_corner_[vertex] = h;
      next_point_[vertex] = first_point_[h / 3];
      first_point_[h / 3] = vertex;
    }
    else
      next_corner_[last_corner_[vertex]] = h;
    last_corner_[vertex] = h;
  }
  sumQuadrics();
}

void
EdgeCollapse::sumQuadrics()
{
  const auto normalOf = [this](const Triangle& t) -> Eigen::Vector3d {
    return (position_[t[1]] - position_[t[0]]).cross(position_[t[2]] - position_[t[0]]);
  };
  for (const Triangle& triangle : mesh_.triangles) {
    const Eigen::Vector3d normal = normalOf(triangle);
    for (const std::uint32_t vertex : triangle)
      quadric_[vertex].addPlane(normal.normalized(), position_[vertex], normal.norm() / 6);
  }
  // A boundary is held by planes through it, across the surface.
  const MeshEdges edges(mesh_.triangles, position_.size());
  edges.forEachEdge([&](const std::uint32_t* first, const std::uint32_t* last) {
    if (last - first == 2)
      return;
    for (const std::uint32_t* h = first; h != last; ++h) {
      const std::uint32_t a = edges.from(*h), b = edges.to(*h);
      const Eigen::Vector3d along = position_[b] - position_[a];
      const Eigen::Vector3d across = along.cross(normalOf(mesh_.triangles[*h / 3])).normalized();
      for (const std::uint32_t vertex : {a, b}) {
        quadric_[vertex].addPlane(across, position_[a], along.squaredNorm());
        is_boundary_[vertex] = true;
      }
    }
  });
  edges.forEachEdge([&](const std::uint32_t* first, const std::uint32_t*) {
    push(edges.from(*first), edges.to(*first));
  });
}

void
EdgeCollapse::push(std::uint32_t a, std::uint32_t b)
{
  if (a > b)
    std::swap(a, b);
  Quadric sum = quadric_[a];
  sum += quadric_[b];
  const double cost = std::max(0.0, sum(bestPosition(a, b, sum)));
  queue_.push({cost, a, b, version_[a], version_[b]});
}

/** Where the quadric is least: on boundaries one of the ends, elsewhere anywhere near. */
Eigen::Vector3d
EdgeCollapse::bestPosition(std::uint32_t a, std::uint32_t b, const Quadric& quadric) const
{
  const Eigen::Vector3d &pa = position_[a], &pb = position_[b];
  if (is_boundary_[a] != is_boundary_[b])
    return is_boundary_[a] ? pa : pb;
  if (is_boundary_[a])
    return quadric(pa) <= quadric(pb) ? pa : pb;
  // Where planes leave a direction open, a weak pull to the middle decides.
  const Eigen::Vector3d middle = (pa + pb) / 2;
  const double pull = 1e-3 * quadric.a.trace() + 1e-30;
  const Eigen::Matrix3d left = quadric.a + pull * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d best = left.ldlt().solve(pull * middle - quadric.b);
  const bool is_near = (best - middle).squaredNorm() < 4 * (pb - pa).squaredNorm(); // not NaN
  return is_near ? best : middle;
}

/** The triangles around both ends; false when nothing would remain. */
bool
EdgeCollapse::collectTriangles()
{
  plan_.removed.clear();
  plan_.remaining.clear();
  plan_.moved.clear();
  const auto has = [this](std::uint32_t t, std::uint32_t vertex) {
    const Triangle& corners = mesh_.triangles[t];
    return corners[0] == vertex || corners[1] == vertex || corners[2] == vertex;
  };
  forEachAround(plan_.keep, [&](std::uint32_t t) {
    (has(t, plan_.drop) ? plan_.removed : plan_.remaining).push_back(t);
  });
  forEachAround(plan_.drop, [&](std::uint32_t t) {
    if (has(t, plan_.keep))
      return;
    plan_.remaining.push_back(t);
    plan_.moved.push_back(t);
  });
  return !plan_.remaining.empty();
}

/** Link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999): the ends have no neighbours in common
 *  but the corners opposite to the edge, which is one of a boundary where both ends are. */
bool
EdgeCollapse::keepsTopology()
{
  const bool at_boundary = plan_.removed.size() == 1;
  if (plan_.removed.empty() || plan_.removed.size() > 2 ||
      (is_boundary_[plan_.keep] && is_boundary_[plan_.drop] && !at_boundary))
    return false;
  const std::uint32_t of_keep = ++question_, of_both = ++question_;
  forEachAround(plan_.keep, [&](std::uint32_t t) {
    for (const std::uint32_t vertex : mesh_.triangles[t])
      mark_[vertex] = of_keep;
  });
  std::size_t common = 0;
  forEachAround(plan_.drop, [&](std::uint32_t t) {
    for (const std::uint32_t vertex : mesh_.triangles[t])
      if (mark_[vertex] == of_keep && vertex != plan_.keep && vertex != plan_.drop) {
        mark_[vertex] = of_both;
        ++common;
      }
  });
  if (common != plan_.removed.size())
    return false;
  // A triangle of `drop` with both opposite corners would fall onto one of `keep`.
  return std::none_of(plan_.moved.begin(), plan_.moved.end(), [&](std::uint32_t t) {
    const Triangle& corners = mesh_.triangles[t];
    return std::count_if(corners.begin(), corners.end(), [&](std::uint32_t vertex) {
             return mark_[vertex] == of_both;
           }) == 2;
  });
}

/** No triangle turns over, nor becomes narrower than it may be or was. */
bool
EdgeCollapse::keepsShape() const
{
  const auto normalOf = [this](std::uint32_t t) -> Eigen::Vector3d {
    const Triangle& c = mesh_.triangles[t];
    return (position_[c[1]] - position_[c[0]]).cross(position_[c[2]] - position_[c[0]]);
  };
  const auto shape = [](double double_area, const auto& a, const auto& b, const auto& c) {
    return double_area /
           std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  };
  Eigen::Vector3d around = Eigen::Vector3d::Zero();
  for (const auto* triangles : {&plan_.removed, &plan_.remaining})
    for (const std::uint32_t t : *triangles)
      around += normalOf(t);
  return std::all_of(plan_.remaining.begin(), plan_.remaining.end(), [&](std::uint32_t t) {
    const Triangle& corners = mesh_.triangles[t];
    const Eigen::Vector3d &a = planned(t, 0), &b = planned(t, 1), &c = planned(t, 2);
    const Eigen::Vector3d before = normalOf(t), after = (b - a).cross(c - a);
    const double shape_before = shape(
        before.norm(), position_[corners[0]], position_[corners[1]], position_[corners[2]]);
    // A narrow triangle's own normal says little.
    const Eigen::Vector3d& reference = shape_before < NARROW ? around : before;
    return shape(after.norm(), a, b, c) >= std::min(NARROW, shape_before) && after.norm() > 0 &&
           reference.dot(after) >= MIN_TURN_COSINE * reference.norm() * after.norm();
  });
}

/** The corner that a boundary loses when two of its vertices become one must lie near the edge
 *  that takes its place: points inside a surface do not notice when it grows over a hole. */
bool
EdgeCollapse::keepsBoundary(double max_error)
{
  const std::uint32_t keep = plan_.keep, drop = plan_.drop;
  plan_.boundary_error = std::max(boundary_error_[keep], boundary_error_[drop]);
  if (plan_.removed.size() != 1)
    return true;
  const std::uint32_t lost = plan_.position == position_[keep] ? drop : keep;
  const std::uint32_t stays = lost == drop ? keep : drop;
  // The neighbours of a boundary vertex along the boundary occur once around it, all others twice.
  std::vector<std::uint32_t> ring;
  forEachAround(lost, [&](std::uint32_t t) {
    for (const std::uint32_t vertex : mesh_.triangles[t])
      if (vertex != lost && vertex != stays)
        ring.push_back(vertex);
  });
  std::sort(ring.begin(), ring.end());
  double nearest = INFINITY;
  for (const std::uint32_t vertex : ring)
    if (std::count(ring.begin(), ring.end(), vertex) == 1) {
      const Eigen::Vector3d& end = position_[vertex];
      nearest = std::min(nearest, squaredDistance(position_[lost], plan_.position, end, end));
    }
  plan_.boundary_error += std::sqrt(nearest);
  return max_error == 0 || plan_.boundary_error <= max_error;
}

/** Finds the nearest of the remaining triangles for each point attached to those around. */
bool
EdgeCollapse::attachPoints(double max_error)
{
  plan_.points.clear();
  plan_.new_triangle.clear();
  plan_.new_error.clear();
  const double limit = max_error > 0 ? max_error * max_error : INFINITY;
  for (const auto* triangles : {&plan_.removed, &plan_.remaining})
    for (const std::uint32_t t : *triangles)
      for (std::uint32_t p = first_point_[t]; p != NONE; p = next_point_[p])
        plan_.points.push_back(p);
  for (const std::uint32_t p : plan_.points) {
    double least = INFINITY;
    std::uint32_t nearest = NONE;
    for (const std::uint32_t t : plan_.remaining) {
      const double d = squaredDistance(point_[p], planned(t, 0), planned(t, 1), planned(t, 2));
      if (d < least) {
        least = d;
        nearest = t;
      }
    }
    if (!(least <= limit))
      return false;
    plan_.new_triangle.push_back(nearest);
    plan_.new_error.push_back(least);
  }
  return true;
}

bool
EdgeCollapse::plan(const Candidate& candidate, double max_error)
{
  plan_.keep = candidate.a;
  plan_.drop = candidate.b;
  if (version_[plan_.keep] != candidate.version_a || version_[plan_.drop] != candidate.version_b)
    return false;
  Quadric sum = quadric_[plan_.keep];
  sum += quadric_[plan_.drop];
  plan_.position = bestPosition(plan_.keep, plan_.drop, sum);
  return collectTriangles() && keepsTopology() && keepsShape() && keepsBoundary(max_error) &&
         attachPoints(max_error);
}

/** Moves the attributes of `keep` towards those of `drop`. */
void
EdgeCollapse::blendAttributes(double share)
{
  const std::uint32_t keep = plan_.keep, drop = plan_.drop;
  const auto s = static_cast<float>(share);
  if (!mesh_.normals.empty()) {
    const Eigen::Vector3f normal = (1 - s) * mesh_.normals[keep] + s * mesh_.normals[drop];
    if (normal.squaredNorm() > 0)
      mesh_.normals[keep] = normal.normalized();
  }
  if (!mesh_.colors.empty())
    for (int i = 0; i < 3; ++i)
      mesh_.colors[keep][i] = static_cast<std::uint8_t>(
          std::lround((1 - s) * float(mesh_.colors[keep][i]) + s * float(mesh_.colors[drop][i])));
  for (auto* list : {&mesh_.weights, &mesh_.deviations})
    if (!list->empty())
      (*list)[keep] = (1 - s) * (*list)[keep] + s * (*list)[drop];
}

void
EdgeCollapse::apply()
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
    for (std::uint32_t& vertex : mesh_.triangles[t])
      vertex = vertex == drop ? keep : vertex;
  for (const std::uint32_t t : plan_.removed)
    mesh_.triangles[t][0] = NONE;
  num_triangles_ -= plan_.removed.size();
  next_corner_[last_corner_[keep]] = first_corner_[drop];
  last_corner_[keep] = last_corner_[drop];

  for (const auto* triangles : {&plan_.removed, &plan_.remaining})
    for (const std::uint32_t t : *triangles)
      first_point_[t] = NONE;
  for (std::size_t i = 0; i < plan_.points.size(); ++i) {
    const std::uint32_t p = plan_.points[i], t = plan_.new_triangle[i];
    point_error_[p] = plan_.new_error[i];
    next_point_[p] = first_point_[t];
    first_point_[t] = p;
  }

  ++version_[keep];
  ++version_[drop];
  const std::uint32_t pushed = ++question_;
  mark_[keep] = pushed;
  for (const std::uint32_t t : plan_.remaining)
    for (const std::uint32_t vertex : mesh_.triangles[t])
      if (mark_[vertex] != pushed) {
        mark_[vertex] = pushed;
        push(keep, vertex);
      }
}

void
EdgeCollapse::run(const MeshDecimationOptions& options)
{
  while (!queue_.empty() && num_triangles_ > options.max_triangles) {
    const Candidate candidate = queue_.top();
    queue_.pop();
    if (plan(candidate, options.max_error))
      apply();
  }
}

void
EdgeCollapse::finish()
{
  for (std::size_t i = 0; i < position_.size(); ++i)
    mesh_.vertices[i] = (position_[i] + middle_).cast<float>();
  std::vector<std::uint8_t> keep(mesh_.triangles.size());
  for (std::uint32_t t = 0; t < keep.size(); ++t)
    keep[t] = isAlive(t);
  keepTriangles(mesh_, keep);
  removeUnusedVertices(mesh_);
}

} // namespace bundle_icp
