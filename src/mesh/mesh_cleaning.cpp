// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_editing.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/mesh/mesh_cleaning.h>

#include <cmath>
#include <cstring>
#include <numeric>

namespace bundle_icp {
namespace {

/** Height over longest edge of a triangle that single precision cannot tell from a line. */
constexpr double LINE = 1e-6;

/** Gives vertices with the same coordinates the number of the first of them. */
std::size_t
mergeVertices(SurfaceMesh& mesh)
{
  using Bits = std::array<std::uint32_t, 3>; // which order NaN as well
  std::vector<std::pair<Bits, std::uint32_t>> places(mesh.vertices.size());
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3f place = mesh.vertices[i].array() + 0.0f; // -0 becomes 0
    std::memcpy(places[i].first.data(), place.data(), sizeof(Bits));
    places[i].second = i;
  }
  std::sort(places.begin(), places.end());
  std::vector<std::uint32_t> numbers(places.size());
  std::size_t merged = 0;
  for (std::size_t i = 0, first = 0; i < places.size(); ++i) {
    if (places[i].first != places[first].first)
      first = i;
    merged += i != first;
    numbers[places[i].second] = places[first].second;
  }
  if (merged > 0)
    for (Triangle& triangle : mesh.triangles)
      for (std::uint32_t& vertex : triangle)
        vertex = numbers[vertex];
  return merged;
}

bool
hasArea(const SurfaceMesh& mesh, const Triangle& triangle)
{
  const Eigen::Vector3d a = corner(mesh, triangle, 0), b = corner(mesh, triangle, 1),
                        c = corner(mesh, triangle, 2);
  return a.allFinite() && b.allFinite() && c.allFinite() && !isNarrow(a, b, c, LINE);
}

/** Removes triangles without area and duplicates of earlier triangles. */
std::size_t
removeDegenerateTriangles(SurfaceMesh& mesh)
{
  std::vector<std::uint8_t> keep(mesh.triangles.size());
  std::vector<std::pair<Triangle, std::uint32_t>> corners;
  corners.reserve(keep.size());
  for (std::uint32_t t = 0; t < keep.size(); ++t) {
    keep[t] = hasArea(mesh, mesh.triangles[t]);
    Triangle sorted = mesh.triangles[t];
    std::sort(sorted.begin(), sorted.end());
    if (keep[t])
      corners.push_back({sorted, t});
  }
  std::sort(corners.begin(), corners.end());
  for (std::size_t i = 1; i < corners.size(); ++i)
    if (corners[i].first == corners[i - 1].first)
      keep[corners[i].second] = false;
  return keepTriangles(mesh, keep);
}

/** Leaves each edge its largest triangle, and the largest of the others, if possible of those
 *  on its other side. */
std::size_t
removeNonManifoldTriangles(SurfaceMesh& mesh)
{
  std::vector<std::uint8_t> keep(mesh.triangles.size(), true);
  const HalfEdges edges(mesh.triangles, mesh.vertices.size());
  edges.forEachEdge([&](const std::uint32_t* first, const std::uint32_t* last) {
    if (last - first <= 2)
      return;
    std::vector<std::uint32_t> around;
    std::copy_if(first, last, std::back_inserter(around),
                 [&](std::uint32_t h) { return keep[h / 3]; });
    std::stable_sort(around.begin(), around.end(), [&](std::uint32_t a, std::uint32_t b) {
      return areaNormal(mesh, mesh.triangles[a / 3]).squaredNorm() >
             areaNormal(mesh, mesh.triangles[b / 3]).squaredNorm();
    });
    const auto is_other_side = [&](std::uint32_t h) {
      return edges.from(h) != edges.from(around.front());
    };
    if (around.size() > 2)
      std::stable_partition(around.begin() + 1, around.end(), is_other_side);
    for (std::size_t i = 2; i < around.size(); ++i)
      keep[around[i] / 3] = false;
  });
  return keepTriangles(mesh, keep);
}

/** Turns triangles so that neighbours run along their shared edge in opposite directions, and
 *  whole components so that they face where their normals point. */
class Orientation {
public:
  explicit Orientation(SurfaceMesh& mesh)
  : mesh_(mesh), edges_(mesh.triangles, mesh.vertices.size()), opposites_(edges_.opposites()),
    flip_(mesh.triangles.size(), UNSEEN)
  {
  }

  std::size_t
  apply()
  {
    for (std::uint32_t t = 0; t < flip_.size(); ++t)
      if (flip_[t] == UNSEEN)
        orientComponent(t);
    std::size_t flipped = 0;
    for (std::size_t t = 0; t < flip_.size(); ++t)
      if (flip_[t] == 1) {
        std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
        ++flipped;
      }
    return flipped;
  }

private:
  static constexpr std::uint8_t UNSEEN = 2;

  void
  orientComponent(std::uint32_t seed)
  {
    std::vector<std::uint32_t> members{seed};
    flip_[seed] = 0;
    bool is_closed = true, is_orientable = true;
    for (std::size_t i = 0; i < members.size(); ++i)
      for (std::uint32_t h = 3 * members[i]; h < 3 * members[i] + 3; ++h) {
        const std::int64_t other = opposites_[h];
        is_closed &= other >= 0;
        if (other < 0)
          continue;
        const bool agrees = edges_.from(h) != edges_.from(std::uint32_t(other));
        const std::uint8_t flip = agrees ? flip_[members[i]] : 1 - flip_[members[i]];
        if (flip_[other / 3] == UNSEEN) {
          flip_[other / 3] = flip;
          members.push_back(std::uint32_t(other / 3));
        }
        is_orientable &= flip_[other / 3] == flip;
      }
    if (!is_orientable)
      for (const std::uint32_t t : members)
        flip_[t] = 0;
    else if (shouldTurn(members, is_closed))
      for (const std::uint32_t t : members)
        flip_[t] = 1 - flip_[t];
  }

  bool
  shouldTurn(const std::vector<std::uint32_t>& members, bool is_closed) const
  {
    double along_normals = 0, volume = 0;
    std::size_t flips = 0;
    const Eigen::Vector3d center = corner(mesh_, mesh_.triangles[members.front()], 0);
    for (const std::uint32_t t : members) {
      const Triangle& triangle = mesh_.triangles[t];
      const Eigen::Vector3d normal = (flip_[t] ? -1 : 1) * areaNormal(mesh_, triangle);
      volume += normal.dot(corner(mesh_, triangle, 0) - center);
      flips += flip_[t];
      if (!mesh_.normals.empty())
        for (const std::uint32_t vertex : triangle)
          if (mesh_.normals[vertex].allFinite())
            along_normals += normal.dot(mesh_.normals[vertex].cast<double>());
    }
    if (along_normals != 0)
      return along_normals < 0;
    return is_closed ? volume < 0 : 2 * flips > members.size();
  }

  SurfaceMesh& mesh_;
  const HalfEdges edges_;
  std::vector<std::int64_t> opposites_;
  std::vector<std::uint8_t> flip_;
};

} // namespace

MeshCleaningResult
cleanExtracted(SurfaceMesh& mesh, const MeshCleaningOptions& options)
{
  MeshCleaningResult result;
  if (options.min_component_area > 0)
    result.small_components = removeSmallAreas(mesh, options.min_component_area);
  if (options.max_hole_perimeter > 0)
    fillHoles(mesh, options.max_hole_perimeter, result);
  removeUnusedVertices(mesh);
  return result;
}

bool
MeshCleaningOptions::isValid(std::string* error) const
{
  const auto check = [error](const char* name, double value, const char* unit) {
    const bool is_valid = value >= 0 && std::isfinite(value);
    if (!is_valid && error)
      *error = std::string("MeshCleaningOptions: ") + name + " " + std::to_string(value) +
               "; expected 0 (none) or more " + unit;
    return is_valid;
  };
  return check("min_component_area", min_component_area, "square metres") &&
         check("max_hole_perimeter", max_hole_perimeter, "metres");
}

MeshCleaningResult
cleanMesh(SurfaceMesh& mesh, const MeshCleaningOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
  checkLists(mesh, "cleanMesh");
  const std::size_t duplicates = mergeVertices(mesh);
  const std::size_t degenerate = removeDegenerateTriangles(mesh);
  const std::size_t non_manifold = removeNonManifoldTriangles(mesh);
  const std::size_t flipped = Orientation(mesh).apply();
  MeshCleaningResult result = cleanExtracted(mesh, options);
  result.duplicate_vertices = duplicates;
  result.degenerate_triangles = degenerate;
  result.non_manifold_triangles = non_manifold;
  result.flipped_triangles = flipped;
  return result;
}

MeshCleaningResult
cleanMesh(pcl::PolygonMesh& mesh, const MeshCleaningOptions& options)
{
  return editSurface(mesh, [&](SurfaceMesh& surface) { return cleanMesh(surface, options); });
}

} // namespace bundle_icp
