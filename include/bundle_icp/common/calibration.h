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

/** Corrections of a camera's nominal intrinsics. */
enum class CalibrationParameter {
  FOCAL_X,       ///< relative error of fx: the true focal length is fx (1 + FOCAL_X)
  FOCAL_Y,       ///< relative error of fy
  CENTER_X,      ///< added to cx [px]
  CENTER_Y,      ///< added to cy [px]
  RADIAL_1,      ///< remaining radial distortion, k1 of OpenCV's model
  RADIAL_2,      ///< remaining radial distortion, k2 of OpenCV's model
  DEPTH_BIAS,    ///< measured depth is too large by this share per metre [1/m]
  DEPTH_TILT_X,  ///< measured depth is too large by this share per unit of x / z
  DEPTH_TILT_Y,  ///< measured depth is too large by this share per unit of y / z
  DEPTH_SHIFT_X, ///< the depth of colour pixel (u, v) is at u + DEPTH_SHIFT_X [px]
  DEPTH_SHIFT_Y, ///< the depth of colour pixel (u, v) is at v + DEPTH_SHIFT_Y [px]
  READOUT,       ///< time from the first to the last row of a colour image [s] (rolling shutter)
  TIME_OFFSET    ///< time from the middle row of colour to depth [s]
};
constexpr int NUM_CALIBRATION_PARAMETERS = 13;

/** One number per CalibrationParameter. */
using CalibrationVector = Eigen::Matrix<double, NUM_CALIBRATION_PARAMETERS, 1>;

/** Name of a parameter in files and reports, for example "focal_x". */
BUNDLE_ICP_EXPORT const char*
calibrationName(CalibrationParameter parameter);

/** Unit of a parameter, for example "px"; "1" for a ratio. */
BUNDLE_ICP_EXPORT const char*
calibrationUnit(CalibrationParameter parameter);

/** Image-wide depth error of one frame, in units of DepthNoise::sigma(): a constant, a part per
 *  unit of x / z and a part per unit of y / z. Structured light drifts by as much from one image to
 *  the next. Such errors do not average out over the image. */
using DepthError = Eigen::Vector3d;

/** Origin of Calibration::depth_scale. */
enum class DepthScaleOrigin {
  NOMINAL,          ///< the recording itself
  CALIBRATION_FILE, ///< readCalibration()
  KNOWN_DISTANCE    ///< a length known from another source
};

/** Corrections to a camera. The measured depth of a point at depth z on the ray (x, y, 1) is
 *
 *    z (1 + DEPTH_BIAS z + DEPTH_TILT_X x + DEPTH_TILT_Y y) + sigma(z) (e0 + e1 x + e2 y)
 *
 *  with the frame's DepthError e. A scan cannot show a common factor of all depth, which would only
 *  make everything larger. That factor, `depth_scale`, needs a length known from another source. */
struct BUNDLE_ICP_EXPORT Calibration {
  CalibrationVector values = CalibrationVector::Zero();
  /** Standard deviations; 0 = not estimated. */
  CalibrationVector deviations = CalibrationVector::Zero();
  /** True depth over measured depth. Never estimated. The reader of the recording applies it
   *  (DatasetOptions::depth_factor). */
  double depth_scale = 1;
  DepthScaleOrigin depth_scale_origin = DepthScaleOrigin::NOMINAL;

  /** Multiplies all depth by `factor`: the true length of a known distance over its length in a
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

/** True depth [m] of a measured depth along the ray (x, y, 1): inverts Calibration's equation. */
BUNDLE_ICP_EXPORT double
correctedDepth(double measured, double x, double y, const Calibration& calibration,
               const DepthError& error, const DepthNoise& noise);

/** The depth image that an error-free camera `calibration.corrected(camera)` would have measured.
 *  \param depth CV_32FC1 [m], of the size of `camera`, NaN = not measured */
BUNDLE_ICP_EXPORT cv::Mat
correctedDepth(const cv::Mat& depth, const CameraIntrinsics& camera, const Calibration& calibration,
               const DepthError& error);

/** The frame that an error-free camera `calibration.corrected(camera)` would have taken, without
 *  correction of the times at which rows and depth were exposed. */
BUNDLE_ICP_EXPORT RGBDFrame
correctedFrame(const RGBDFrame& frame, const CameraIntrinsics& camera,
               const Calibration& calibration, const DepthError& error);

} // namespace bundle_icp
