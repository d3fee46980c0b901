// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "landmarks.h"

#include <bundle_icp/common/calibration.h>

#include <cmath>
#include <random>
#include <vector>

namespace bundle_icp::test {

/** World from camera of a hand-held camera around the origin: up to 0.7 m and 0.8 rad a
 * second. */
inline Pose
handHeldPose(double time)
{
  const auto swing = [time](double amplitude, double hertz, double phase) {
    return amplitude * std::sin(2 * M_PI * hertz * time + phase);
  };
  Vector6d position;
  position << swing(0.15, 0.47, 0.5), swing(0.25, 0.29, 2), swing(0.2, 0.53, 1),
      swing(0.35, 0.31, 0), swing(0.2, 0.43, 1), swing(0.2, 0.37, 2);
  return increment(position);
}

/** A camera that takes landmarks wrongly, in the way that calibration.h puts into
 * words. It shares no code with the library's model of these errors, but for the names.
 */
struct FaultyCamera {
  Calibration faults;
  double depth_factor = 1;       ///< measured over true depth
  double depth_error_sigmas = 0; ///< standard deviation of the DepthError of each image
  double pixel_sigma = 0.5;      ///< [px]
  double rate = 12;              ///< images per second
  unsigned seed = 0;             ///< of the noise
};

/** An image of a FaultyCamera. */
struct FaultyView {
  LandmarkView view;
  double time = 0; ///< of the middle row [s]
  DepthError depth_error = DepthError::Zero();
};

namespace detail {

/** Normal of the surface around a landmark, within 35 degrees of the direction to the
 * cameras. */
inline Eigen::Vector3d
surfaceNormal(int landmark)
{
  const Pose tilt = randomMotion(unsigned(landmark) + 1000, 0.6, 0);
  return tilt.linear() * -Eigen::Vector3d::UnitZ();
}

inline Eigen::Vector2d
faultyPixel(const Eigen::Vector3d& point, const CameraIntrinsics& camera, const Calibration& faults)
{
  using P = CalibrationParameter;
  const Eigen::Vector2d ray = point.head<2>() / point.z();
  const double r2 = ray.squaredNorm();
  const double radial = 1 + faults[P::RADIAL_1] * r2 + faults[P::RADIAL_2] * r2 * r2;
  return {camera.fx * (1 + faults[P::FOCAL_X]) * radial * ray.x() + camera.cx + faults[P::CENTER_X],
          camera.fy * (1 + faults[P::FOCAL_Y]) * radial * ray.y() + camera.cy +
              faults[P::CENTER_Y]};
}

/** Where a camera on the move sees a point: by the row that is exposed when it is seen
 * there. */
inline Eigen::Vector2d
rolledPixel(const Eigen::Vector3d& point, double time, const CameraIntrinsics& camera,
            const Calibration& faults)
{
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  for (int round = 0; round < 6; ++round) {
    const double rows = pixel.y() - (camera.height - 1) / 2.0;
    const double row_time = time + faults[CalibrationParameter::READOUT] * rows / camera.height;
    const Eigen::Vector3d in_camera = handHeldPose(row_time).inverse() * point;
    if (!(in_camera.z() > 0.3))
      return {-1e9, -1e9};
    pixel = faultyPixel(in_camera, camera, faults);
  }
  return pixel;
}

} // namespace detail

/** The landmarks as seen at a time, with noise. */
inline FaultyView
lookWrongly(const Landmarks& landmarks, const FaultyCamera& faulty, double time, unsigned seed)
{
  using P = CalibrationParameter;
  const Calibration& faults = faulty.faults;
  const CameraIntrinsics& camera = landmarks.camera();
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  FaultyView result;
  result.time = time;
  result.view.world_from_camera = handHeldPose(time);
  for (double& e : result.depth_error)
    e = faulty.depth_error_sigmas * normal(random);
  const Pose depth_camera = handHeldPose(time + faults[P::TIME_OFFSET]).inverse();
  Features& f = result.view.features;
  f.sharpness = 1;
  for (int i = 0; i < landmarks.descriptors().rows; ++i) {
    const Eigen::Vector2d pixel = detail::rolledPixel(landmarks.point(i), time, camera, faults);
    if (!camera.contains(pixel))
      continue;
    const Eigen::Vector3d in_camera = depth_camera * landmarks.point(i);
    const Eigen::Vector3d n = depth_camera.linear() * detail::surfaceNormal(i);
    // What lies at the same pixel of the depth image is seen by the colour pixel beside
    // it.
    const Eigen::Vector3d beside(faults[P::DEPTH_SHIFT_X] / camera.fx,
                                 faults[P::DEPTH_SHIFT_Y] / camera.fy, 0);
    const Eigen::Vector3d ray = in_camera / in_camera.z() - beside;
    const double z = n.dot(in_camera) / n.dot(ray);
    const double sigma = DepthNoise().sigma(z);
    const double measured = z * (1 + faults[P::DEPTH_BIAS] * z + faults[P::DEPTH_TILT_X] * ray.x() +
                                 faults[P::DEPTH_TILT_Y] * ray.y()) +
                            sigma * result.depth_error.dot(Eigen::Vector3d(1, ray.x(), ray.y()));
    const Eigen::Vector2d noise(normal(random), normal(random));
    f.pixels.push_back((pixel + faulty.pixel_sigma * noise).cast<float>());
    f.pixel_sigmas.push_back(float(faulty.pixel_sigma));
    f.depths.push_back(float(faulty.depth_factor * measured + sigma * normal(random)));
    f.depth_sigmas.push_back(float(sigma));
    const Eigen::Vector2d slope(n.x() / camera.fx, n.y() / camera.fy);
    f.depth_slopes.push_back((-z / n.dot(ray) * slope).cast<float>());
    f.colors.emplace_back(10, 20, 30);
    f.descriptors.push_back(landmarks.descriptors().row(i));
    result.view.landmarks.push_back(i);
  }
  return result;
}

/** `count` images along the hand-held path. */
inline std::vector<FaultyView>
recordWrongly(const Landmarks& landmarks, const FaultyCamera& faulty, unsigned count)
{
  std::vector<FaultyView> views;
  for (unsigned i = 0; i < count; ++i)
    views.push_back(lookWrongly(landmarks, faulty, i / faulty.rate, 1000 * faulty.seed + i));
  return views;
}

} // namespace bundle_icp::test
