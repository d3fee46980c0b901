// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/depth_noise.h>
#include <bundle_icp/export.h>

#include <Eigen/Core>
#include <string>

namespace bundle_icp {

/** Pinhole camera with the distortion of OpenCV (k1, k2, p1, p2, k3).
 *
 *  Pixels follow OpenCV: the centre of the top left pixel is (0, 0). The reader of a recording
 *  removes distortion; project() and unproject() belong to the ideal pinhole camera. */
struct BUNDLE_ICP_EXPORT CameraIntrinsics {
  int width = 0;  ///< image width [px]
  int height = 0; ///< image height [px]
  double fx = 0;  ///< focal length along x [px]
  double fy = 0;  ///< focal length along y [px]
  double cx = 0;  ///< principal point x [px]
  double cy = 0;  ///< principal point y [px]
  /** Radial (k) and tangential (p) distortion of the recorded images; 0 when undistorted. */
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  /** Noise of the camera's depth images; every step of a run uses it. */
  DepthNoise depth_noise;

  /** Pixel of a point in the camera frame [m] with z > 0, without distortion. */
  Eigen::Vector2d
  project(const Eigen::Vector3d& point) const
  {
    return {fx * point.x() / point.z() + cx, fy * point.y() / point.z() + cy};
  }

  /** Point in the camera frame [m] of an undistorted pixel at depth z [m] along the axis. */
  Eigen::Vector3d
  unproject(double u, double v, double z) const
  {
    return {(u - cx) / fx * z, (v - cy) / fy * z, z};
  }

  /** True when the pixel, rounded to the nearest, lies in the image. */
  bool
  contains(const Eigen::Vector2d& pixel) const
  {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width - 0.5 &&
           pixel.y() < height - 0.5;
  }

  bool
  hasDistortion() const
  {
    return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0;
  }

  /** The same camera with images reduced by an integer factor: each new pixel covers factor x
   *  factor old pixels. */
  CameraIntrinsics
  reduced(int factor) const;

  /** The same camera without distortion: the camera of the frames that a reader returns. */
  CameraIntrinsics
  undistorted() const;

  /** Checks that the numbers can belong to a camera: finite, positive sizes and focal lengths, a
   *  field of view between 5 and 160 degrees, the principal point inside the image, a valid
   *  depth_noise. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** Reads `fx,fy,cx,cy[,k1,k2,p1,p2,k3]`, separated by commas or blanks; width and height stay 0.
 *  \throws pcl::BadArgumentException naming the text when it has another form. */
BUNDLE_ICP_EXPORT CameraIntrinsics
parseIntrinsics(const std::string& text);

} // namespace bundle_icp
