// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/mesh/surface_mesh.h>

#include <opencv2/core/mat.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace bundle_icp {

/** What frames have seen in a cell of space. */
enum class Seen : std::uint8_t {
  NOTHING, ///< no frame has seen the cell
  FREE,    ///< a frame has looked through it
  SURFACE  ///< a surface goes through it
};

/** The space of a scan in cubic cells: free, surface, or seen by no frame. Unlike a TSDFVolume it
 *  also knows the space far from surfaces. Outside of its box nothing is seen. The content depends
 *  neither on the order of the frames nor on the number of threads. */
class SeenSpace {
public:
  /** Largest number of cells, a byte each. */
  static constexpr double MAX_CELLS = 1 << 24;

  /** \param cell_size edge of a cell [m]; grows until the box has at most MAX_CELLS */
  SeenSpace(const Eigen::AlignedBox3d& box, double cell_size);

  /** Adds what a frame saw. A cell is free when depth at its centre's pixel lies behind the whole
   *  cell by more than the noise.
   *  \param depth CV_32FC1 [m] */
  void
  look(const cv::Mat& depth, const CameraIntrinsics& camera, const Pose& world_from_camera,
       int num_threads);

  /** A camera was here: the cells within `radius` [m] are free. */
  void
  stand(const Eigen::Vector3d& center, double radius);

  /** Cells of the mesh are surface, whatever frames say. */
  void
  addSurface(const SurfaceMesh& mesh);

  double
  cellSize() const
  {
    return cell_size_;
  }

  std::size_t
  numCells() const
  {
    return cells_.size();
  }

  /** Calls visit(point) for points of free space on a grid of a given spacing [m]. */
  template <typename Visit>
  void
  forEachFree(double spacing, const Visit& visit) const
  {
    const int step = std::max(1, int(std::lround(spacing / cell_size_)));
    for (int z = step / 2; z < size_.z(); z += step)
      for (int y = step / 2; y < size_.y(); y += step)
        for (int x = step / 2; x < size_.x(); x += step)
          if (const std::size_t cell = indexOf({x, y, z}); (*this)[cell] == Seen::FREE)
            visit(center(cell));
  }

  Seen
  operator[](std::size_t cell) const
  {
    const std::uint8_t marks = cells_[cell];
    if (marks & MESH)
      return Seen::SURFACE;
    return marks & LOOKED_THROUGH ? Seen::FREE : marks & MEASURED ? Seen::SURFACE : Seen::NOTHING;
  }

  /** The cell of a point, if the box holds it. */
  std::optional<std::size_t>
  find(const Eigen::Vector3d& point) const
  {
    const Eigen::Array3i cell = cellOf(point);
    return isInside(cell) ? std::optional<std::size_t>(indexOf(cell)) : std::nullopt;
  }

  Seen
  at(const Eigen::Vector3d& point) const
  {
    const std::optional<std::size_t> cell = find(point);
    return cell ? (*this)[*cell] : Seen::NOTHING;
  }

  Eigen::Vector3d
  center(std::size_t cell) const;

  /** Calls visit(cell, distance [m]) for the cells along a ray, from its origin on, as long as
   *  visit returns true and the ray is inside the box.
   *  \param direction of unit length */
  template <typename Visit>
  void
  walk(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length,
       const Visit& visit) const;

private:
  static constexpr std::uint8_t LOOKED_THROUGH = 1, MEASURED = 2, MESH = 4;

  Eigen::Array3i
  cellOf(const Eigen::Vector3d& point) const
  {
    return ((point - low_) / cell_size_).array().floor().cast<int>();
  }

  bool
  isInside(const Eigen::Array3i& cell) const
  {
    return (cell >= 0).all() && (cell < size_).all();
  }

  std::size_t
  indexOf(const Eigen::Array3i& cell) const
  {
    return (std::size_t(cell.z()) * size_.y() + cell.y()) * size_.x() + cell.x();
  }

  void
  mark(const Eigen::Vector3d& point, std::uint8_t mark);

  Eigen::Vector3d low_;
  double cell_size_;
  Eigen::Array3i size_;
  std::vector<std::uint8_t> cells_;
};

template <typename Visit>
void
SeenSpace::walk(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length,
                const Visit& visit) const
{
  // Amanatides and Woo, A fast voxel traversal algorithm for ray tracing, Eurographics 1987.
  const Eigen::Array3d start = (origin - low_).array() / cell_size_;
  Eigen::Array3i cell = start.floor().cast<int>(), step;
  Eigen::Array3d next, period;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = direction[axis] < 0 ? -1 : 1;
    period[axis] = 1 / std::max(std::abs(direction[axis]), 1e-12);
    const double inside = start[axis] - cell[axis];
    next[axis] = period[axis] * (step[axis] < 0 ? inside : 1 - inside);
  }
  const double end = length / cell_size_;
  for (double at = 0; at < end && isInside(cell);) {
    if (!visit(indexOf(cell), at * cell_size_))
      return;
    int axis = 0;
    at = next.minCoeff(&axis);
    cell[axis] += step[axis];
    next[axis] += period[axis];
  }
}

} // namespace bundle_icp
