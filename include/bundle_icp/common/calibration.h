// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/depth_noise.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bundle_icp {

/** What may differ between a camera and the intrinsics that it comes with. */
enum class CalibrationParameter {
  FOCAL_X,       ///< relative error of fx: the true one is fx (1 + FOCAL_X)
  FOCAL_Y,       ///< relative error of fy
  CENTER_X,      ///< added to cx [px]
  CENTER_Y,      ///< added to cy [px]
  RADIAL_1,      ///< remaining radial distortion, k1 of OpenCV's model
  RADIAL_2,      ///< ... and k2
  DEPTH_BIAS,    ///< depth is measured too large by this share per metre [1/m]
  DEPTH_TILT_X,  ///< ... by this share per unit of x / z
  DEPTH_TILT_Y,  ///< ... by this share per unit of y / z
  DEPTH_SHIFT_X, ///< the depth of colour pixel (u, v) is found at u + DEPTH_SHIFT_X [px]
  DEPTH_SHIFT_Y, ///< ... and at v + DEPTH_SHIFT_Y [px]
  READOUT,       ///< time from the first to the last row of a colour image [s] (rolling shutter)
  TIME_OFFSET    ///< depth is taken this much after the middle row of colour [s]
};
constexpr int NUM_CALIBRATION_PARAMETERS = 13;

/** One number per CalibrationParameter. */
using CalibrationVector = Eigen::Matrix<double, NUM_CALIBRATION_PARAMETERS, 1>;

/** Name of a parameter as files and reports have it, "focal_x" for example. */
BUNDLE_ICP_EXPORT const char*
calibrationName(CalibrationParameter parameter);

/** Unit of a parameter, "px" for example; "1" for a ratio. */
BUNDLE_ICP_EXPORT const char*
calibrationUnit(CalibrationParameter parameter);

/** Image-wide depth error of one frame, in units of DepthNoise::sigma(): constant, and per unit of
 *  x / z and of y / z. Structured light drifts by as much from one image to the next, and
 *  such errors do not average out over the image. */
using DepthError = Eigen::Vector3d;

/** Where Calibration::depth_scale comes from. */
enum class DepthScaleOrigin {
  NOMINAL,          ///< depth as the recording gives it
  CALIBRATION_FILE, ///< readCalibration()
  KNOWN_DISTANCE    ///< a length that is known from elsewhere
};

/** Corrections to a camera. The measured depth of a point at depth z that is seen along the ray
 *  (x, y, 1) is
 *
 *    z (1 + DEPTH_BIAS z + DEPTH_TILT_X x + DEPTH_TILT_Y y) + sigma(z) (e0 + e1 x + e2 y)
 *
 *  with the frame's DepthError e. A common factor of all depth cannot be seen in a scan (all of
 *  it would only be larger): it is a length known from elsewhere, `depth_scale`. */
struct BUNDLE_ICP_EXPORT Calibration {
  CalibrationVector values = CalibrationVector::Zero();
  /** Standard deviations; 0 = not estimated. */
  CalibrationVector deviations = CalibrationVector::Zero();
  /** True depth over measured depth. Never estimated; it is the reader that applies it
   *  (DatasetOptions::depth_factor). */
  double depth_scale = 1;
  DepthScaleOrigin depth_scale_origin = DepthScaleOrigin::NOMINAL;

  /** Multiplies all depth by `factor`, which a known distance gives: its true length over that in a
   *  reconstruction made with this calibration. */
  void
  scaleDepth(double factor);

  double&
  operator[](CalibrationParameter parameter)
  {
    return values[int(parameter)];
  }

  double
  operator[](CalibrationParameter parameter) const
  {
    return values[int(parameter)];
  }

  /** The camera with corrected focal lengths and principal point. */
  CameraIntrinsics
  corrected(const CameraIntrinsics& camera) const;

  bool
  isValid(std::string* error = nullptr) const;
};

/** True depth [m] along the ray (x, y, 1) of a measured one: the inverse of the equation above. */
BUNDLE_ICP_EXPORT double
correctedDepth(double measured, double x, double y, const Calibration& calibration,
               const DepthError& error, const DepthNoise& noise);

/** A depth image as an error-free camera `calibration.corrected(camera)` had measured it.
 *  \param depth CV_32FC1 [m], of the size of `camera`, NaN = not measured */
BUNDLE_ICP_EXPORT cv::Mat
correctedDepth(const cv::Mat& depth, const CameraIntrinsics& camera, const Calibration& calibration,
               const DepthError& error);

/** A frame as an error-free camera `calibration.corrected(camera)` had taken it, but for the times
 *  at which rows and depth were exposed. */
BUNDLE_ICP_EXPORT RGBDFrame
correctedFrame(const RGBDFrame& frame, const CameraIntrinsics& camera,
               const Calibration& calibration, const DepthError& error);

} // namespace bundle_icp
