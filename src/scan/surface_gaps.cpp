// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/surface_gaps.h"

#include "mesh/mesh_editing.h"

#include <cmath>

namespace bundle_icp {
namespace {

/** Angles by which a surface may bend where it is missing: none, or 20 degrees to either side. */
constexpr double BENDS[] = {0, 0.35, -0.35};
/** Cells of surface in which a boundary lies, as thick as noise and the grid make it. */
constexpr double THICKNESS = 2.5;
/** Cells of the narrowest gap: what is narrower may be a step of the grid. */
constexpr std::size_t NARROWEST = 3;

/** Marks the unseen cells between a boundary and the next surface on a ray. */
void
continueSurface(const SeenSpace& space, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& direction, double max_gap, std::vector<std::uint8_t>& gaps)
{
  std::vector<std::size_t> unseen;
  bool is_closed = false;
  space.walk(origin, direction, max_gap, [&](std::size_t cell, double distance) {
    const Seen seen = space[cell];
    if (seen == Seen::NOTHING)
      unseen.push_back(cell);
    else if (seen == Seen::FREE || !unseen.empty()) {
      is_closed = seen == Seen::SURFACE;
      return false;
    }
    return !unseen.empty() || distance < THICKNESS * space.cellSize();
  });
  if (is_closed && unseen.size() >= NARROWEST)
    for (const std::size_t cell : unseen)
      gaps[cell] = true;
}

/** Fills the stripes of one or two cells between the rays that have marked gaps. */
void
fillStripes(const SeenSpace& space, std::vector<std::uint8_t>& gaps)
{
  const std::vector<std::uint8_t> rays = gaps;
  for (std::size_t cell = 0; cell < rays.size(); ++cell) {
    if (!rays[cell])
      continue;
    const Eigen::Vector3d center = space.center(cell);
    for (int i = 0; i < 13; ++i) { // of two opposite directions one
      const Eigen::Vector3d step =
          space.cellSize() * Eigen::Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      std::vector<std::size_t> between;
      for (int k = 1; k <= 3; ++k) {
        const auto next = space.find(center + k * step);
        if (!next || space[*next] != Seen::NOTHING)
          break;
        if (rays[*next]) {
          for (const std::size_t unmarked : between)
            gaps[unmarked] = true;
          break;
        }
        between.push_back(*next);
      }
    }
  }
}

} // namespace

std::vector<std::uint8_t>
findGaps(const SurfaceMesh& mesh, const SeenSpace& space, double max_gap,
         const std::optional<OrientedBox>& region)
{
  std::vector<std::uint8_t> gaps(space.numCells(), false);
  const HalfEdges edges(mesh.triangles, mesh.vertices.size());
  const std::vector<std::int64_t> opposites = edges.opposites();
  for (std::uint32_t h = 0; h < opposites.size(); ++h) {
    if (opposites[h] >= 0)
      continue;
    const Eigen::Vector3d a = mesh.vertices[edges.from(h)].cast<double>(),
                          b = mesh.vertices[edges.to(h)].cast<double>(),
                          normal = areaNormal(mesh, mesh.triangles[h / 3]).normalized(),
                          outward = (b - a).normalized().cross(normal);
    // Cells before a slanted surface may be free as a whole: one also looks half a cell behind it.
    for (const double depth : {0.0, space.cellSize() / 2})
      for (const double bend : BENDS)
        continueSurface(space, (a + b) / 2 - depth * normal,
                        std::cos(bend) * outward + std::sin(bend) * normal, max_gap, gaps);
  }
  fillStripes(space, gaps);
  if (region)
    for (std::size_t cell = 0; cell < gaps.size(); ++cell)
      gaps[cell] = gaps[cell] && region->contains(space.center(cell));
  return gaps;
}

} // namespace bundle_icp
