// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/cell_grid.h"

#include <algorithm>
#include <utility>

namespace bundle_icp {

CellGrid::CellGrid(const std::vector<Cloud>& clouds, const std::vector<Pose>& world_from_cameras,
                   const ObjectRegionOptions& options)
: size_(options.cell_size)
{
  for (std::size_t frame = 0; frame < clouds.size(); ++frame)
    for (const pcl::PointXYZ& point : clouds[frame]) {
      const Eigen::Vector3d in_camera = point.getVector3fMap().cast<double>();
      if (!(in_camera.norm() <= options.max_depth)) // NaN fails, too
        continue;
      const Eigen::Vector3d in_world = world_from_cameras[frame] * in_camera;
      Cell& cell = cells_[keyOf(in_world)];
      cell.sum += in_world;
      ++cell.points;
      cell.frames += std::exchange(cell.last_frame, frame + 1) != frame + 1;
    }
  // What one frame alone sees may be a flying pixel.
  const std::size_t min_frames = std::min<std::size_t>(2, clouds.size());
  centers.reset(new Cloud);
  for (auto& [key, cell] : cells_)
    if (cell.frames >= min_frames) {
      numbers_[key] = int(centers->size());
      const Eigen::Vector3f mean = (cell.sum / double(cell.points)).cast<float>();
      centers->push_back({mean.x(), mean.y(), mean.z()});
      weights_.push_back(cell.points);
    }
}

int
CellGrid::at(const Eigen::Vector3d& point) const
{
  const auto found = numbers_.find(keyOf(point));
  return found == numbers_.end() ? -1 : found->second;
}

CellGrid::Cloud::Ptr
CellGrid::weightedPoints(std::size_t max_points) const
{
  std::size_t total = 0;
  for (const std::size_t weight : weights_)
    total += weight;
  const double step = std::max(1.0, double(total) / double(max_points));
  const Cloud::Ptr points(new Cloud);
  double passed = 0;
  for (std::size_t i = 0; i < weights_.size(); ++i)
    for (passed += double(weights_[i]); passed >= step; passed -= step)
      points->push_back((*centers)[i]);
  return points;
}

CellGrid::Key
CellGrid::keyOf(const Eigen::Vector3d& point) const
{
  const Eigen::Vector3i cell = (point / size_).array().floor().cast<int>();
  return {cell.z(), cell.y(), cell.x()};
}

} // namespace bundle_icp
