// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/visible_surface.h"

#include "simulation/renderer.h"

#include <cmath>
#include <omp.h>
#include <unordered_set>

namespace bundle_icp {
namespace simulation {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;
using Voxels = std::unordered_set<std::uint64_t>;

/** Number of the voxel; 21 bits each way hold 2 km at 1 mm. */
std::uint64_t
voxelOf(const Eigen::Vector3d& point, double spacing)
{
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto step = std::int64_t(std::floor(point[axis] / spacing)) + (1 << 20);
    key = key << 21 | (std::uint64_t(step) & 0x1fffff);
  }
  return key;
}

/** Points of one view, one a voxel. */
Cloud
seenFrom(const Scene& scene, const CameraIntrinsics& camera, const Pose& pose, double spacing)
{
  const GeometryImage geometry = renderGeometry(scene, camera, pose);
  const cv::Mat normals = renderNormals(scene, camera, pose, geometry);
  Cloud cloud;
  Voxels voxels;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (geometry.face.at<int>(y, x) < 0)
        continue;
      const Eigen::Vector3d point = pose * camera.unproject(x, y, geometry.depth.at<float>(y, x));
      if (!voxels.insert(voxelOf(point, spacing)).second)
        continue;
      const cv::Vec3f& normal = normals.at<cv::Vec3f>(y, x);
      cloud.push_back(pcl::PointNormal(float(point.x()), float(point.y()), float(point.z()),
                                       normal[0], normal[1], normal[2]));
    }
  return cloud;
}

} // namespace

Cloud::Ptr
visibleSurface(const Scene& scene, const CameraIntrinsics& camera, const std::vector<Pose>& poses,
               double spacing, int num_threads)
{
  auto surface = pcl::make_shared<Cloud>();
  Voxels voxels;
  const int threads = num_threads > 0 ? num_threads : omp_get_max_threads();
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) ordered
  for (std::int64_t i = 0; i < std::int64_t(poses.size()); ++i) {
    const Cloud cloud = seenFrom(scene, camera, poses[std::size_t(i)], spacing);
    // In order, so that the first point of a voxel does not depend on the threads.
#pragma omp ordered
    for (const pcl::PointNormal& point : cloud)
      if (voxels.insert(voxelOf(point.getVector3fMap().cast<double>(), spacing)).second)
        surface->push_back(point);
  }
  return surface;
}

} // namespace simulation
} // namespace bundle_icp
