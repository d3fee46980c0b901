// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <Eigen/Core>
#include <Eigen/StdVector>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace bundle_icp {

/** How features are found and given a depth. */
struct BUNDLE_ICP_EXPORT FeatureOptions {
  /** Maximum number of keypoints of an image: the strongest are kept, then those without depth are
   *  dropped. The cost of matching grows with the square of this number. */
  int max_features = 1200;
  /** Contrast below which SIFT drops a keypoint (of [0, 1] grey levels). OpenCV's default 0.04
   *  leaves too few keypoints on plain walls, and faint keypoints do not mislead verification. */
  double contrast_threshold = 0.005;
  /** SIFT gets the image reduced by this integer factor, or by less where the shorter side would
   *  fall below 240 px; SIFT then doubles it for its finest octave. Pixels of a consumer camera
   *  hold little detail at their own scale: 2 takes a third of the time of 1, and poses are more
   *  accurate. */
  int image_reduction = 2;
  /** Half size of the window that gives a keypoint its depth [px]. A window with a depth edge gives
   *  no depth. */
  int depth_radius = 3;
  /** Standard deviation of a keypoint's position at the finest scale [px]. */
  double pixel_sigma = 0.7;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Local features of one image, F_i = {(x_j, d_j)} of equation (2), with measured depth. The
 *  vectors have equal length; feature j is row j of `descriptors`. */
struct Features {
  std::vector<Eigen::Vector2f> pixels; ///< x_j, position in the undistorted image [px]
  std::vector<float> pixel_sigmas;     ///< standard deviation of the position [px]
  std::vector<float> depths;           ///< along the axis [m], NaN = none (hole or edge)
  std::vector<float> depth_sigmas;     ///< standard deviation of the depth [m]
  /** Change of depth per pixel along u and v [m/px]; may be empty = unknown. */
  std::vector<Eigen::Vector2f> depth_slopes;
  std::vector<cv::Vec3b> colors; ///< colour of the image at the feature, BGR
  /** d_j: RootSIFT (Arandjelovic, Zisserman, CVPR 2012), CV_8UC1, N x 128, in units of 1/256 and at
   *  most 127, so that a product of two descriptors fits the integer SIMD instructions. */
  cv::Mat descriptors;
  /** Mean squared gradient over mean squared contrast; falls when the image is blurred. */
  double sharpness = 0;

  std::size_t
  size() const
  {
    return pixels.size();
  }

  Eigen::Vector2f
  depthSlope(std::size_t j) const
  {
    return depth_slopes.empty() ? Eigen::Vector2f::Zero() : depth_slopes[j];
  }

  bool
  hasDepth(std::size_t j) const
  {
    return depths[j] > 0;
  }
};

/** Point [m] of feature j in the camera frame; needs hasDepth(j). */
inline Eigen::Vector3d
pointInCamera(const Features& features, std::size_t j, const CameraIntrinsics& camera)
{
  return camera.unproject(features.pixels[j].x(), features.pixels[j].y(), features.depths[j]);
}

/** Variance of the point of feature j as one number for all directions [m^2]: depth noise plus the
 *  sideways effect of the pixel error; needs hasDepth(j). */
inline double
pointVariance(const Features& features, std::size_t j, const CameraIntrinsics& camera)
{
  const double lateral = features.pixel_sigmas[j] * features.depths[j] / camera.fx;
  return lateral * lateral + double(features.depth_sigmas[j]) * features.depth_sigmas[j];
}

/** Finds SIFT features (Lowe, IJCV 2004) and measures their depth. The order of the features
 *  depends only on the image.
 *  \throws pcl::BadArgumentException for invalid options or images of wrong type or size. */
BUNDLE_ICP_EXPORT Features
extractFeatures(const RGBDFrame& frame, const CameraIntrinsics& camera,
                const FeatureOptions& options = {});

} // namespace bundle_icp
