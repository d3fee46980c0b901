// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/seen_space.h"

#include "common/parallel.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Farthest depth of an image [m]; 0 without any. */
float
farthest(const cv::Mat& depth)
{
  float largest = 0;
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u)
      largest = std::max(largest, std::isfinite(depth.at<float>(v, u)) ? depth.at<float>(v, u) : 0);
  return largest;
}

/** Box around what a camera sees up to a depth. */
Eigen::AlignedBox3d
frustumBox(const CameraIntrinsics& camera, const Pose& world_from_camera, double depth)
{
  Eigen::AlignedBox3d box(world_from_camera.translation());
  for (const double u : {-0.5, camera.width - 0.5})
    for (const double v : {-0.5, camera.height - 0.5})
      box.extend(world_from_camera * camera.unproject(u, v, depth));
  return box;
}

/** The part of a row of points begin + x step, in the camera's frame, that may lie in its images:
 *  that on the inner side of the planes through its centre and the image's edges. */
std::pair<int, int>
visiblePart(const CameraIntrinsics& camera, const Eigen::Vector3d& begin,
            const Eigen::Vector3d& step, int first, int last)
{
  const Eigen::Vector3d low = camera.unproject(-1, -1, 1),
                        high = camera.unproject(camera.width, camera.height, 1);
  double from = first, to = last;
  for (const Eigen::Vector3d& inward :
       {Eigen::Vector3d(1, 0, -low.x()), Eigen::Vector3d(-1, 0, high.x()),
        Eigen::Vector3d(0, 1, -low.y()), Eigen::Vector3d(0, -1, high.y())}) {
    const double at_begin = inward.dot(begin), slope = inward.dot(step);
    if (slope > 0)
      from = std::max(from, -at_begin / slope);
    else if (slope < 0)
      to = std::min(to, -at_begin / slope);
    else if (at_begin < 0)
      return {0, -1};
  }
  if (from > to)
    return {0, -1};
  return {int(std::ceil(from)), int(std::floor(to))};
}

} // namespace

SeenSpace::SeenSpace(const Eigen::AlignedBox3d& box, double cell_size)
: low_(box.min()), cell_size_(cell_size)
{
  const auto sizeOf = [&box](double edge) {
    return Eigen::Array3d((box.sizes().array() / edge).floor() + 1);
  };
  while (sizeOf(cell_size_).prod() > MAX_CELLS)
    cell_size_ *= 1.1;
  size_ = sizeOf(cell_size_).cast<int>();
  cells_.resize(std::size_t(size_.cast<std::ptrdiff_t>().prod()), 0);
}

void
SeenSpace::look(const cv::Mat& depth, const CameraIntrinsics& camera, const Pose& world_from_camera,
                int num_threads)
{
  const float range = farthest(depth);
  const Eigen::AlignedBox3d box = frustumBox(camera, world_from_camera, range);
  const Eigen::Array3i first = cellOf(box.min()).max(0), last = cellOf(box.max()).min(size_ - 1);
  if (!(range > 0) || (first > last).any())
    return;
  const Pose camera_from_world = world_from_camera.inverse();
  const double half_diagonal = std::sqrt(0.75) * cell_size_;
  parallelFor(std::size_t(last.z() - first.z() + 1), num_threads, {}, [&](std::size_t slice) {
    for (int y = first.y(); y <= last.y(); ++y) {
      const std::size_t row = indexOf({0, y, first.z() + int(slice)});
      const Eigen::Vector3d begin = camera_from_world * center(row),
                            step = cell_size_ * camera_from_world.linear().col(0);
      const auto [from, to] = visiblePart(camera, begin, step, first.x(), last.x());
      for (int x = from; x <= to; ++x) {
        std::uint8_t& marks = cells_[row + std::size_t(x)];
        const Eigen::Vector3d point = begin + x * step;
        if (marks & LOOKED_THROUGH || !(point.z() > 1e-3))
          continue;
        const Eigen::Vector2d pixel = camera.project(point);
        if (!camera.contains(pixel))
          continue;
        const double z = depth.at<float>(int(std::lround(pixel.y())), int(std::lround(pixel.x())));
        const double margin = half_diagonal + 2 * camera.depth_noise.sigma(z);
        if (point.z() < z - margin) // false where nothing was measured
          marks |= LOOKED_THROUGH;
        else if (point.z() <= z + margin)
          marks |= MEASURED;
      }
    }
  });
}

void
SeenSpace::stand(const Eigen::Vector3d& center, double radius)
{
  const int reach = int(std::ceil(radius / cell_size_));
  for (int z = -reach; z <= reach; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x)
        if (const Eigen::Vector3d offset = cell_size_ * Eigen::Vector3d(x, y, z);
            offset.norm() <= radius)
          mark(center + offset, LOOKED_THROUGH);
}

void
SeenSpace::addSurface(const SurfaceMesh& mesh)
{
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>(),
                          ab = mesh.vertices[triangle[1]].cast<double>() - a,
                          ac = mesh.vertices[triangle[2]].cast<double>() - a;
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    const int parts = std::max(1, int(std::ceil(2 * longest / cell_size_)));
    for (int i = 0; i <= parts; ++i)
      for (int j = 0; i + j <= parts; ++j)
        mark(a + (double(i) * ab + double(j) * ac) / parts, MESH);
  }
}

Eigen::Vector3d
SeenSpace::center(std::size_t cell) const
{
  const auto width = std::size_t(size_.x()), height = std::size_t(size_.y());
  const Eigen::Vector3d index(double(cell % width), double(cell / width % height),
                              double(cell / width / height));
  return low_ + cell_size_ * (index.array() + 0.5).matrix();
}

void
SeenSpace::mark(const Eigen::Vector3d& point, std::uint8_t mark)
{
  if (const std::optional<std::size_t> cell = find(point))
    cells_[*cell] |= mark;
}

} // namespace bundle_icp
