// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "model/measurement_model.h"

#include <algorithm>

namespace bundle_icp {

using P = CalibrationParameter;

/** The motion to second order in time: a frame is read out in some 20 ms, a rotation of 100
 *  degrees a second then leaves less than 0.01 px. */
Eigen::Vector3d
MeasurementModel::moved(const Eigen::Vector3d& point, double time, Eigen::Matrix3d* by_point,
                        Eigen::Vector3d* by_time) const
{
  const Eigen::Vector3d rotation = motion_.head<3>(), translation = motion_.tail<3>();
  const Eigen::Vector3d turned = rotation.cross(point), turned_twice = rotation.cross(turned);
  if (by_point) {
    by_point->setIdentity();
    if (time != 0) {
      const Eigen::Matrix3d w = crossMatrix(rotation);
      *by_point += time * w + 0.5 * time * time * w * w;
    }
  }
  if (by_time)
    *by_time = turned + translation + time * turned_twice;
  return point + time * (turned + translation) + 0.5 * time * time * turned_twice;
}

Eigen::Vector2d
MeasurementModel::pixel(const Eigen::Vector3d& point, double row,
                        Eigen::Matrix<double, 2, 3>* by_point,
                        CalibrationRows2* by_calibration) const
{
  Eigen::Matrix3d moved_by_point;
  Eigen::Vector3d moved_by_time;
  const double time = rowTime(row);
  const Eigen::Vector3d p =
      moved(point, at(P::READOUT) * time, by_point || by_calibration ? &moved_by_point : nullptr,
            by_calibration ? &moved_by_time : nullptr);
  // Behind the camera there is no pixel; a far one keeps the residual valid and is downweighted.
  const double z = std::max(p.z(), 1e-3);
  const double x = p.x() / z, y = p.y() / z, r2 = x * x + y * y;
  const double k1 = at(P::RADIAL_1), k2 = at(P::RADIAL_2);
  const double radial = 1 + r2 * (k1 + r2 * k2);
  const Eigen::Vector2d distorted(x * radial, y * radial);
  const double fx = camera_.fx * (1 + at(P::FOCAL_X)), fy = camera_.fy * (1 + at(P::FOCAL_Y));
  if (by_point || by_calibration) {
    const double slope = 2 * (k1 + 2 * k2 * r2); // of radial by x, over x
    Eigen::Matrix<double, 2, 2> by_ray;
    by_ray << fx * (radial + slope * x * x), fx * slope * x * y, fy * slope * x * y,
        fy * (radial + slope * y * y);
    Eigen::Matrix<double, 2, 3> ray_by_moved;
    ray_by_moved << 1 / z, 0, -x / z, 0, 1 / z, -y / z;
    if (p.z() < z) // the bound does not move with the point
      ray_by_moved.col(2).setZero();
    const Eigen::Matrix<double, 2, 3> by_moved = by_ray * ray_by_moved;
    if (by_point)
      *by_point = by_moved * moved_by_point;
    if (by_calibration) {
      by_calibration->setZero();
      (*by_calibration)(0, int(P::FOCAL_X)) = camera_.fx * distorted.x();
      (*by_calibration)(1, int(P::FOCAL_Y)) = camera_.fy * distorted.y();
      (*by_calibration)(0, int(P::CENTER_X)) = 1;
      (*by_calibration)(1, int(P::CENTER_Y)) = 1;
      by_calibration->col(int(P::RADIAL_1)) = Eigen::Vector2d(fx * x, fy * y) * r2;
      by_calibration->col(int(P::RADIAL_2)) = Eigen::Vector2d(fx * x, fy * y) * r2 * r2;
      by_calibration->col(int(P::READOUT)) = by_moved * moved_by_time * time;
    }
  }
  return {fx * distorted.x() + camera_.cx + at(P::CENTER_X),
          fy * distorted.y() + camera_.cy + at(P::CENTER_Y)};
}

double
MeasurementModel::depth(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel,
                        const DepthError& error, const DepthNoise& noise,
                        Eigen::RowVector3d* by_point, CalibrationRow* by_calibration,
                        Eigen::RowVector3d* by_error) const
{
  Eigen::Matrix3d moved_by_point;
  Eigen::Vector3d moved_by_time;
  const double z = moved(point, at(P::TIME_OFFSET), by_point ? &moved_by_point : nullptr,
                         by_calibration ? &moved_by_time : nullptr)
                       .z();
  // The ray only scales small errors: its own corrections do not matter here.
  const double x = (pixel.x() - camera_.cx) / camera_.fx;
  const double y = (pixel.y() - camera_.cy) / camera_.fy;
  const double tilt = at(P::DEPTH_TILT_X) * x + at(P::DEPTH_TILT_Y) * y;
  const double shared = error[0] + error[1] * x + error[2] * y;
  const double sigma = noise.sigma(z);
  const double by_z =
      1 + 2 * at(P::DEPTH_BIAS) * z + tilt + 2 * noise.quadratic * (z - noise.offset) * shared;
  if (by_point)
    *by_point = by_z * moved_by_point.row(2);
  if (by_calibration) {
    by_calibration->setZero();
    (*by_calibration)[int(P::DEPTH_BIAS)] = z * z;
    (*by_calibration)[int(P::DEPTH_TILT_X)] = z * x;
    (*by_calibration)[int(P::DEPTH_TILT_Y)] = z * y;
    (*by_calibration)[int(P::TIME_OFFSET)] = by_z * moved_by_time.z();
  }
  if (by_error)
    *by_error << sigma, sigma * x, sigma * y;
  return z * (1 + at(P::DEPTH_BIAS) * z + tilt) + sigma * shared;
}

Eigen::Vector3d
MeasurementModel::unproject(const Eigen::Vector2d& pixel, double z) const
{
  const double time = at(P::READOUT) * rowTime(pixel.y());
  const double x = (pixel.x() - camera_.cx - at(P::CENTER_X)) / (camera_.fx * (1 + at(P::FOCAL_X)));
  const double y = (pixel.y() - camera_.cy - at(P::CENTER_Y)) / (camera_.fy * (1 + at(P::FOCAL_Y)));
  double undistorted_x = x, undistorted_y = y;
  for (int round = 0; round < 4; ++round) {
    const double r2 = undistorted_x * undistorted_x + undistorted_y * undistorted_y;
    const double radial = 1 + r2 * (at(P::RADIAL_1) + r2 * at(P::RADIAL_2));
    undistorted_x = x / radial;
    undistorted_y = y / radial;
  }
  const Eigen::Vector3d point(undistorted_x * z, undistorted_y * z, z);
  return moved(point, -time, nullptr, nullptr);
}

} // namespace bundle_icp
