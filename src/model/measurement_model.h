// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>

namespace bundle_icp {

using CalibrationRow = Eigen::Matrix<double, 1, NUM_CALIBRATION_PARAMETERS>;
using CalibrationRows2 = Eigen::Matrix<double, 2, NUM_CALIBRATION_PARAMETERS>;

/** How a camera measures points. The camera's motion turns and moves points in the camera frame
 *  by increment(t motion) in t seconds; a pose is that of the moment when the middle row of
 *  the colour image is exposed. */
class MeasurementModel {
public:
  MeasurementModel(const CameraIntrinsics& camera, const CalibrationVector& calibration,
                   const Vector6d& motion)
  : camera_(camera), calibration_(calibration), motion_(motion)
  {
  }

  /** Pixel of a point in the camera frame, as seen by frame row `row`. Derivatives are
   *  written where not null. */
  Eigen::Vector2d
  pixel(const Eigen::Vector3d& point, double row, Eigen::Matrix<double, 2, 3>* by_point = nullptr,
        CalibrationRows2* by_calibration = nullptr) const;

  /** Depth that is measured for a point, seen at a colour pixel. */
  double
  depth(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel, const DepthError& error,
        const DepthNoise& noise, Eigen::RowVector3d* by_point = nullptr,
        CalibrationRow* by_calibration = nullptr, Eigen::RowVector3d* by_error = nullptr) const;

  /** Point in the camera frame of a pixel with true depth z at the time when its row was exposed:
   *  the inverse of pixel(). */
  Eigen::Vector3d
  unproject(const Eigen::Vector2d& pixel, double z) const;

private:
  double
  at(CalibrationParameter parameter) const
  {
    return calibration_[int(parameter)];
  }

  /** Seconds from the middle row to `row`, over READOUT. */
  double
  rowTime(double row) const
  {
    return (row + 0.5) / camera_.height - 0.5;
  }

  Eigen::Vector3d
  moved(const Eigen::Vector3d& point, double time, Eigen::Matrix3d* by_point,
        Eigen::Vector3d* by_time) const;

  const CameraIntrinsics& camera_;
  const CalibrationVector calibration_;
  const Vector6d motion_;
};

} // namespace bundle_icp
