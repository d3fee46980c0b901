// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/target_grid.h"

#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Median offset from its own pixel, above which a target was not seen from the given
 * pose. */
constexpr double MAX_OFFSET = 3;

Eigen::Vector3d
pointAt(const PointsView& view, std::size_t index)
{
  return Eigen::Map<const Eigen::Vector3f>(view.xyz + index * view.stride).cast<double>();
}

/** Median distance [px] between where points project and their place in the grid. */
double
gridOffset(const PointsView& target, const CameraIntrinsics& camera, const Pose& virtual_from_world)
{
  std::vector<double> offsets;
  // About 4000 samples; the step shares no factor with usual widths, so that columns
  // vary.
  const std::size_t step = std::max<std::size_t>(1, target.size / 4000) | 1;
  for (std::size_t i = 0; i < target.size; i += step) {
    const Eigen::Vector3d p = virtual_from_world * pointAt(target, i);
    if (!p.allFinite())
      continue;
    const Eigen::Vector2d place(double(i % std::size_t(target.width)),
                                double(i / std::size_t(target.width)));
    offsets.push_back(p.z() > 0 ? (camera.project(p) - place).norm() : 1e9);
  }
  if (offsets.empty())
    return 0;
  const auto middle = offsets.begin() + std::ptrdiff_t(offsets.size() / 2);
  std::nth_element(offsets.begin(), middle, offsets.end());
  return *middle;
}

/** The target's points with normals fitted to the depth image that they form. */
void
computeNormals(const AlignmentProblem& problem, TargetGrid& grid)
{
  const PointsView points = grid.points;
  cv::Mat depth(points.height, points.width, CV_32F);
  const Pose virtual_from_world = grid.world_from_virtual.inverse();
  for (std::size_t i = 0; i < points.size; ++i)
    depth.ptr<float>()[i] = float((virtual_from_world * pointAt(points, i)).z());
  VirtualDepthOptions options;
  options.num_threads = problem.num_threads;
  const DepthView view = makeDepthView(depth, grid.camera, 1, options);
  const Eigen::Matrix3f rotation = grid.world_from_virtual.linear().cast<float>();
  grid.storage.resize(6 * points.size);
  for (std::size_t i = 0; i < points.size; ++i) {
    std::copy_n(points.xyz + i * points.stride, 3, &grid.storage[6 * i]);
    Eigen::Map<Eigen::Vector3f>(&grid.storage[6 * i + 3]) =
        rotation * Eigen::Map<const Eigen::Vector3f>(view.normals.ptr<float>() + 3 * i);
  }
  grid.points.xyz = grid.storage.data();
  grid.points.normals = grid.storage.data() + 3;
  grid.points.stride = 6;
}

} // namespace

bool
hasUnitNormals(const PointsView& view)
{
  if (!view.normals)
    return false;
  std::size_t finite = 0, unit = 0;
  const std::size_t step = std::max<std::size_t>(1, view.size / 4000) | 1;
  for (std::size_t i = 0; i < view.size; i += step) {
    if (!pointAt(view, i).allFinite())
      continue;
    ++finite;
    const float norm = Eigen::Map<const Eigen::Vector3f>(view.normals + i * view.stride).norm();
    unit += std::abs(norm - 1) < 0.01f ? 1 : 0;
  }
  return 2 * unit > finite;
}

std::optional<TargetGrid>
makeTargetGrid(const AlignmentProblem& problem, const PointsView& target,
               const Pose& world_from_virtual, std::string& reason)
{
  if (target.height <= 1 || target.width <= 1) {
    reason = "the target is not organized";
    return std::nullopt;
  }
  TargetGrid grid;
  grid.points = target;
  grid.world_from_virtual = world_from_virtual;
  grid.camera = problem.camera->undistorted();
  const int factor = grid.camera.width / target.width;
  if (factor > 1)
    grid.camera = grid.camera.reduced(factor);
  if (grid.camera.width != target.width || grid.camera.height != target.height) {
    reason = "the target has " + std::to_string(target.width) + "x" +
             std::to_string(target.height) + " points, the camera " +
             std::to_string(problem.camera->width) + "x" + std::to_string(problem.camera->height) +
             " pixels";
    return std::nullopt;
  }
  const double offset = gridOffset(target, grid.camera, world_from_virtual.inverse());
  if (offset > MAX_OFFSET) {
    reason = "the target's points project " + std::to_string(offset) +
             " px from their place in its grid; was it rendered at the virtual depth pose?";
    return std::nullopt;
  }
  if (!hasUnitNormals(target))
    computeNormals(problem, grid);
  return grid;
}

} // namespace bundle_icp
