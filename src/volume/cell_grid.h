// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/volume/object_region.h>

#include <array>
#include <map>
#include <vector>

namespace bundle_icp {

/** Points of several frames in cubic cells of the world, ordered by place. Cells that one frame
 *  alone sees do not count, unless there is no other frame. */
class CellGrid {
public:
  using Cloud = pcl::PointCloud<pcl::PointXYZ>;

  /** Cells of ObjectRegionOptions::cell_size; points beyond its max_depth are left out. */
  CellGrid(const std::vector<Cloud>& clouds, const std::vector<Pose>& world_from_cameras,
           const ObjectRegionOptions& options);

  /** Index into `centers` of the cell that holds a point, or -1. */
  int
  at(const Eigen::Vector3d& point) const;

  /** Cells as often as there are points in them, so that what fills the frames counts most,
   *  thinned to about `max_points`. */
  Cloud::Ptr
  weightedPoints(std::size_t max_points) const;

  Cloud::Ptr centers; ///< mean of each cell's points

private:
  using Key = std::array<int, 3>;

  /** What all frames saw within one cell. */
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t points = 0, frames = 0;
    std::size_t last_frame = 0; ///< counted from 1
  };

  Key
  keyOf(const Eigen::Vector3d& point) const;

  double size_;
  std::map<Key, Cell> cells_;
  std::map<Key, int> numbers_;
  std::vector<std::size_t> weights_; // number of each cell's points
};

} // namespace bundle_icp
