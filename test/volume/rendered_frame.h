// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/rgbd_frame.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace bundle_icp::test {

/** Smallest t > 0 at which origin + t direction meets the scene; NaN = never. */
using Intersection =
    std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;
/** Colour, BGR, of a point of the surface. */
using Paint = std::function<cv::Vec3b(const Eigen::Vector3d& point)>;

inline constexpr double none = std::numeric_limits<double>::quiet_NaN();

inline CameraIntrinsics
smallCamera()
{
  CameraIntrinsics camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 262.5;
  camera.cx = 159.5;
  camera.cy = 119.5;
  return camera;
}

/** Voxels as large as this camera's images resolve. */
inline TSDFOptions
coarseOptions()
{
  TSDFOptions options;
  options.voxel_size = 0.01;
  options.truncation = 0.04;
  return options;
}

/** Exact depth and colour of a scene. */
inline RGBDFrame
render(
    const Intersection& scene, const Pose& world_from_camera,
    const Paint& paint = [](const Eigen::Vector3d&) { return cv::Vec3b(50, 100, 150); },
    const CameraIntrinsics& camera = smallCamera())
{
  RGBDFrame frame;
  frame.depth.create(camera.height, camera.width, CV_32FC1);
  frame.color.create(camera.height, camera.width, CV_8UC3);
  const Eigen::Vector3d origin = world_from_camera.translation();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = world_from_camera.linear() * camera.unproject(u, v, 1);
      const double z = scene(origin, ray);
      frame.depth.at<float>(v, u) = float(z);
      frame.color.at<cv::Vec3b>(v, u) =
          std::isnan(z) ? cv::Vec3b(0, 0, 0) : paint(origin + z * ray);
    }
  return frame;
}

inline Intersection
sphere(double radius)
{
  return [radius](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const double a = ray.squaredNorm(), b = origin.dot(ray);
    const double root = b * b - a * (origin.squaredNorm() - radius * radius);
    return root < 0 ? none : (-b - std::sqrt(root)) / a;
  };
}

/** The plane normal . x = offset. */
inline Intersection
plane(const Eigen::Vector3d& normal, double offset)
{
  return [normal, offset](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const double t = (offset - normal.dot(origin)) / normal.dot(ray);
    return t > 0 ? t : none;
  };
}

inline Pose
lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target)
{
  Pose pose = Pose::Identity();
  const Eigen::Vector3d z = (target - eye).normalized();
  // Not aligned with any axis that the tests look along.
  const Eigen::Vector3d x = Eigen::Vector3d(0.1, 0.9, 0.2).cross(z).normalized();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.translation() = eye;
  return pose;
}

/** Poses that look at the origin from all sides: from the faces and corners of a cube.
 */
inline std::vector<Pose>
posesAllAround(double distance)
{
  std::vector<Pose> poses;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      poses.push_back(lookAt(sign * distance * Eigen::Vector3d::Unit(axis), {0, 0, 0}));
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d eye(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    poses.push_back(lookAt(distance * eye.normalized(), {0, 0, 0}));
  }
  return poses;
}

} // namespace bundle_icp::test
