// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/calibration.h>

#include "common/depth_sigma.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <array>
#include <cmath>

namespace bundle_icp {
namespace {

using P = CalibrationParameter;

/** Bounds of corrections; larger values would mean another camera. */
const CalibrationVector&
bounds()
{
  static const CalibrationVector vector = [] {
    CalibrationVector b;
    b << 0.2, 0.2, 100, 100, 0.5, 1, 0.2, 0.3, 0.3, 30, 30, 0.1, 0.2;
    return b;
  }();
  return vector;
}

/** Image moved so that what is found at p + shift lies at p. */
cv::Mat
shifted(const cv::Mat& depth, double dx, double dy)
{
  if (dx == 0 && dy == 0)
    return depth;
  cv::Mat moved;
  const cv::Matx23d from(1, 0, dx, 0, 1, dy);
  // The nearest pixel: a mean over a depth edge is a point in the air.
  cv::warpAffine(depth, moved, from, depth.size(), cv::INTER_NEAREST | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT, cv::Scalar(std::numeric_limits<double>::quiet_NaN()));
  return moved;
}

/** Removes radial distortion that is left in the image. */
cv::Mat
undistorted(const cv::Mat& image, const CameraIntrinsics& camera, const Calibration& calibration,
            int interpolation, const cv::Scalar& border)
{
  const double k1 = calibration[P::RADIAL_1], k2 = calibration[P::RADIAL_2];
  if (k1 == 0 && k2 == 0)
    return image;
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Mat map_x, map_y, result;
  cv::initUndistortRectifyMap(matrix, cv::Vec4d(k1, k2, 0, 0), cv::noArray(), matrix, image.size(),
                              CV_32FC1, map_x, map_y);
  cv::remap(image, result, map_x, map_y, interpolation, cv::BORDER_CONSTANT, border);
  return result;
}

/** Errors are a few percent: each round leaves that share of what is left. */
constexpr int CORRECTION_ROUNDS = 4;

/** The corrections along one row of depth, which change evenly from pixel to pixel. */
struct RowCorrection {
  DepthSigma sigma;
  float shared, shared_step; ///< DepthError on the first pixel's ray, and from each to the next
  float tilt, tilt_step;     ///< the same of DEPTH_TILT
  float bias;
};

/** correctedDepth() for a whole row, in single precision. */
BUNDLE_ICP_INLINE void
correctRow(const RowCorrection& correction, int width, float* depth)
{
  const RowCorrection c = correction; // a copy, which no store below can change
#pragma omp simd
  for (int u = 0; u < width; ++u) {
    const float measured = depth[u], column = float(u);
    const float shared = c.shared + column * c.shared_step;
    const float tilt = 1 + c.tilt + column * c.tilt_step;
    const bool is_measured = measured > 0;
    const float start = is_measured ? measured : 1.0f;
    float z = start;
    for (int round = 0; round < CORRECTION_ROUNDS; ++round) {
      z = (start - c.sigma(z) * shared) / (tilt + c.bias * z);
    }
    depth[u] = is_measured ? z : measured;
  }
}

} // namespace

const char*
calibrationName(CalibrationParameter parameter)
{
  static const std::array<const char*, NUM_CALIBRATION_PARAMETERS> names{
      "focal_x",       "focal_y",    "center_x",     "center_y",     "radial_1",
      "radial_2",      "depth_bias", "depth_tilt_x", "depth_tilt_y", "depth_shift_x",
      "depth_shift_y", "readout",    "time_offset"};
  return names[std::size_t(parameter)];
}

const char*
calibrationUnit(CalibrationParameter parameter)
{
  static const std::array<const char*, NUM_CALIBRATION_PARAMETERS> units{
      "1", "1", "px", "px", "1", "1", "1/m", "1", "1", "px", "px", "s", "s"};
  return units[std::size_t(parameter)];
}

void
Calibration::scaleDepth(double factor)
{
  depth_scale *= factor;
  depth_scale_origin = DepthScaleOrigin::KNOWN_DISTANCE;
  // The same share at what is now another depth
  (*this)[P::DEPTH_BIAS] /= factor;
  deviations[int(P::DEPTH_BIAS)] /= factor;
}

CameraIntrinsics
Calibration::corrected(const CameraIntrinsics& camera) const
{
  CameraIntrinsics result = camera;
  result.fx *= 1 + (*this)[P::FOCAL_X];
  result.fy *= 1 + (*this)[P::FOCAL_Y];
  result.cx += (*this)[P::CENTER_X];
  result.cy += (*this)[P::CENTER_Y];
  return result;
}

bool
Calibration::isValid(std::string* error) const
{
  std::string reason;
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i)
    if (!(std::abs(values[i]) <= bounds()[i]))
      reason =
          std::string(calibrationName(P(i))) + " must lie within +-" + std::to_string(bounds()[i]);
  if (!(depth_scale > 0.5 && depth_scale < 2))
    reason = "depth_scale must lie in (0.5, 2)";
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

double
correctedDepth(double measured, double x, double y, const Calibration& calibration,
               const DepthError& error, const DepthNoise& noise)
{
  const double shared = error[0] + error[1] * x + error[2] * y;
  const double tilt = calibration[P::DEPTH_TILT_X] * x + calibration[P::DEPTH_TILT_Y] * y;
  double z = measured;
  for (int round = 0; round < CORRECTION_ROUNDS; ++round)
    z = (measured - noise.sigma(z) * shared) / (1 + calibration[P::DEPTH_BIAS] * z + tilt);
  return z;
}

cv::Mat
correctedDepth(const cv::Mat& depth, const CameraIntrinsics& camera, const Calibration& calibration,
               const DepthError& error)
{
  const CameraIntrinsics exact = calibration.corrected(camera);
  cv::Mat result = undistorted(
      shifted(depth, calibration[P::DEPTH_SHIFT_X], calibration[P::DEPTH_SHIFT_Y]), exact,
      calibration, cv::INTER_NEAREST, cv::Scalar(std::numeric_limits<double>::quiet_NaN()));
  if (result.data == depth.data)
    result = depth.clone();
  const auto tilt_x = calibration[P::DEPTH_TILT_X], tilt_y = calibration[P::DEPTH_TILT_Y];
  for (int v = 0; v < result.rows; ++v) {
    const double x = -exact.cx / exact.fx, y = (v - exact.cy) / exact.fy;
    simd::call<correctRow>({DepthSigma(camera.depth_noise),
                            float(error[0] + error[1] * x + error[2] * y),
                            float(error[1] / exact.fx), float(tilt_x * x + tilt_y * y),
                            float(tilt_x / exact.fx), float(calibration[P::DEPTH_BIAS])},
                           result.cols, result.ptr<float>(v));
  }
  return result;
}

RGBDFrame
correctedFrame(const RGBDFrame& frame, const CameraIntrinsics& camera,
               const Calibration& calibration, const DepthError& error)
{
  RGBDFrame result = frame;
  result.color = undistorted(frame.color, calibration.corrected(camera), calibration,
                             cv::INTER_LINEAR, cv::Scalar::all(0));
  result.depth = correctedDepth(frame.depth, camera, calibration, error);
  return result;
}

} // namespace bundle_icp
