// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bundle_icp/simulation/synthetic_scan.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <cmath>
#include <limits>
#include <random>

/** Scenes that the tests of registration share. */
namespace bundle_icp::test {

inline const SyntheticScan&
room()
{
  static const SyntheticScan scan = [] {
    SyntheticScanOptions options;
    options.width = 320;
    options.height = 240;
    options.focal_length = 262.5;
    return SyntheticScan(options);
  }();
  return scan;
}

/** Adds Gaussian noise of the model, a fresh draw for each seed. */
inline cv::Mat
noisy(const cv::Mat& exact, unsigned seed, const DepthNoise& noise = {})
{
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  cv::Mat depth = exact.clone();
  for (int i = 0; i < int(depth.total()); ++i) {
    float& z = depth.ptr<float>()[i];
    z += float(noise.sigma(z) * normal(random));
  }
  return depth;
}

inline CameraIntrinsics
smallCamera(int width = 160, int height = 120, double focal = 131.25)
{
  CameraIntrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal;
  camera.cx = (width - 1) / 2.0;
  camera.cy = (height - 1) / 2.0;
  return camera;
}

/** Exact depth of the plane normal . x = distance, in the camera frame. */
inline cv::Mat
planeDepth(const CameraIntrinsics& camera, const Eigen::Vector3d& normal, double distance)
{
  cv::Mat depth(camera.height, camera.width, CV_32F);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const double z = distance / normal.dot(camera.unproject(u, v, 1));
      depth.at<float>(v, u) = z > 0 ? float(z) : std::numeric_limits<float>::quiet_NaN();
    }
  return depth;
}

inline Pose
randomMotion(unsigned seed, double angle, double distance)
{
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Eigen::Vector3d(x, y, z).normalized();
  };
  Vector6d delta;
  delta.head<3>() = angle * direction();
  delta.tail<3>() = distance * direction();
  return increment(delta);
}

inline double
degrees(double radians)
{
  return radians * 180 / M_PI;
}

} // namespace bundle_icp::test
