// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_editing.h"

#include <limits>
#include <set>

namespace bundle_icp {
namespace {

/** Cost of triangulation grows with the cube of the number of edges. */
constexpr std::size_t MAX_EDGES = 1000;
/** Height over longest edge below which a triangle is not made. */
constexpr double NARROW = 1e-4;
constexpr double IMPOSSIBLE = std::numeric_limits<double>::infinity();

using Loop = std::vector<std::uint32_t>; ///< half-edges, or vertices

/** Cuts a boundary that visits a vertex more than once, as where holes meet in a vertex, into loops
 *  that do not. */
void
addSimpleLoops(const HalfEdges& edges, const Loop& boundary, std::vector<Loop>& loops)
{
  Loop open;
  for (const std::uint32_t h : boundary) {
    open.push_back(h);
    const auto start = std::find_if(open.begin(), open.end(),
                                    [&](std::uint32_t g) { return edges.from(g) == edges.to(h); });
    if (start == open.end())
      continue;
    loops.emplace_back(start, open.end());
    open.erase(start, open.end());
  }
}

/** The boundaries of the mesh as half-edges, one after the other. */
std::vector<Loop>
findBoundaries(const HalfEdges& edges)
{
  // Where triangles are not oriented alike, as a Moebius strip cannot be, there is no hole.
  std::vector<std::int64_t> opposites = edges.opposites();
  std::vector<std::uint8_t> is_seam(opposites.size(), false);
  for (std::uint32_t h = 0; h < opposites.size(); ++h)
    is_seam[h] = opposites[h] >= 0 && edges.from(h) == edges.from(std::uint32_t(opposites[h]));
  for (std::uint32_t h = 0; h < opposites.size(); ++h)
    if (is_seam[h])
      opposites[h] = -1;

  std::vector<Loop> boundaries;
  std::vector<std::uint8_t> seen(opposites.size(), false);
  for (std::uint32_t start = 0; start < opposites.size(); ++start) {
    if (opposites[start] >= 0 || seen[start])
      continue;
    Loop boundary;
    for (std::uint32_t h = start; !seen[h];) {
      seen[h] = true;
      boundary.push_back(h);
      h = HalfEdges::next(h);
      while (opposites[h] >= 0)
        h = HalfEdges::next(std::uint32_t(opposites[h]));
    }
    if (std::none_of(boundary.begin(), boundary.end(), [&](std::uint32_t h) { return is_seam[h]; }))
      addSimpleLoops(edges, boundary, boundaries);
  }
  return boundaries;
}

/** The triangulation of a polygon in space with the shortest edges in sum (Gilbert 1979,
 *  Klincsek 1980): what closes corners 0 ... n - 1 is what closes i ... k and k ... j, and the
 *  triangle i, k, j. */
class PolygonTriangulation {
public:
  /** `isFree` says of two corners whether an edge may join them. */
  template <typename IsFree>
  PolygonTriangulation(const std::vector<Eigen::Vector3d>& corners, const IsFree& isFree)
  : corners_(corners), size_(corners.size()), cost_(size_ * size_, IMPOSSIBLE),
    split_(size_ * size_, 0)
  {
    for (std::size_t i = 0; i + 1 < size_; ++i)
      cost(i, i + 1) = 0;
    for (std::size_t span = 2; span < size_; ++span)
      for (std::size_t i = 0; i + span < size_; ++i)
        if (span == size_ - 1 || isFree(i, i + span))
          chooseSplit(i, i + span);
  }

  bool
  isPossible() const
  {
    return cost_[size_ - 1] < IMPOSSIBLE;
  }

  /** Corners of the triangles, in the polygon's direction. */
  std::vector<std::array<std::size_t, 3>>
  triangles() const
  {
    std::vector<std::array<std::size_t, 3>> result;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, size_ - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j - i < 2)
        continue;
      const std::size_t k = split_[i * size_ + j];
      result.push_back({i, k, j});
      open.push_back({i, k});
      open.push_back({k, j});
    }
    return result;
  }

private:
  double&
  cost(std::size_t i, std::size_t j)
  {
    return cost_[i * size_ + j];
  }

  void
  chooseSplit(std::size_t i, std::size_t j)
  {
    double best = IMPOSSIBLE;
    for (std::size_t k = i + 1; k < j; ++k) {
      const double sum = cost(i, k) + cost(k, j);
      if (sum < best && !isNarrow(corners_[i], corners_[k], corners_[j], NARROW)) {
        best = sum;
        split_[i * size_ + j] = std::uint32_t(k);
      }
    }
    cost(i, j) = best + (corners_[j] - corners_[i]).norm();
  }

  const std::vector<Eigen::Vector3d>& corners_;
  std::size_t size_;
  std::vector<double> cost_;
  std::vector<std::uint32_t> split_;
};

class HoleFilling {
public:
  HoleFilling(SurfaceMesh& mesh, MeshCleaningResult& result)
  : mesh_(mesh), edges_(mesh.triangles, mesh.vertices.size()), result_(result)
  {
  }

  void
  fill(double max_perimeter)
  {
    for (const Loop& boundary : findBoundaries(edges_))
      if (boundary.size() >= 3 && boundary.size() <= MAX_EDGES &&
          perimeter(boundary) <= max_perimeter)
        fillOne(boundary);
    mesh_.triangles.insert(mesh_.triangles.end(), added_.begin(), added_.end());
  }

private:
  double
  perimeter(const Loop& boundary) const
  {
    double sum = 0;
    for (const std::uint32_t h : boundary)
      sum += (place(edges_.to(h)) - place(edges_.from(h))).norm();
    return sum;
  }

  Eigen::Vector3d
  place(std::uint32_t vertex) const
  {
    return mesh_.vertices[vertex].cast<double>();
  }

  void
  fillOne(const Loop& boundary)
  {
    Loop vertices; // against the boundary's direction, as its other side demands
    std::vector<Eigen::Vector3d> corners;
    for (auto h = boundary.rbegin(); h != boundary.rend(); ++h) {
      vertices.push_back(edges_.to(*h));
      corners.push_back(place(vertices.back()));
    }
    const auto isFree = [&](std::size_t i, std::size_t j) {
      const std::uint32_t a = vertices[i], b = vertices[j];
      return a != b && !edges_.areJoined(a, b) && !new_edges_.count(std::minmax(a, b));
    };
    const PolygonTriangulation triangulation(corners, isFree);
    if (!triangulation.isPossible())
      return;
    std::vector<Triangle> triangles;
    for (const auto& [i, j, k] : triangulation.triangles())
      triangles.push_back({vertices[i], vertices[j], vertices[k]});
    if (foldsBack(boundary, triangles))
      return;
    for (const Triangle& triangle : triangles) {
      for (int i = 0; i < 3; ++i)
        new_edges_.insert(std::minmax(triangle[i], triangle[(i + 1) % 3]));
      result_.filled_area += areaNormal(mesh_, triangle).norm() / 2;
      added_.push_back(triangle);
    }
    ++result_.holes_filled;
  }

  /** The outer boundary of a patch is none of a hole: what would close it lies on the patch's
   *  back, which shows in the angle between the two. */
  bool
  foldsBack(const Loop& boundary, const std::vector<Triangle>& triangles) const
  {
    Eigen::Vector3d inside = Eigen::Vector3d::Zero(), around = Eigen::Vector3d::Zero();
    for (const Triangle& triangle : triangles)
      inside += areaNormal(mesh_, triangle);
    for (const std::uint32_t h : boundary)
      around += areaNormal(mesh_, mesh_.triangles[h / 3]).normalized() *
                (place(edges_.to(h)) - place(edges_.from(h))).norm();
    return inside.dot(around) < -0.5 * inside.norm() * around.norm();
  }

  SurfaceMesh& mesh_;
  HalfEdges edges_;
  std::vector<Triangle> added_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> new_edges_;
  MeshCleaningResult& result_;
};

} // namespace

void
fillHoles(SurfaceMesh& mesh, double max_perimeter, MeshCleaningResult& result)
{
  HoleFilling(mesh, result).fill(max_perimeter);
}

} // namespace bundle_icp
