// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>

#include <opencv2/core/mat.hpp>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <string>

namespace bundle_icp {

using ColorCloud = pcl::PointCloud<pcl::PointXYZRGBA>;

/** The images that an organized cloud in the frame of the camera shows. */
struct CloudImages {
  cv::Mat color; ///< CV_8UC3, BGR
  cv::Mat depth; ///< CV_32FC1 [m], NaN = none
};

CloudImages
imagesOf(const ColorCloud& cloud);

/** The camera that brings the points of an organized cloud closest to their pixels. */
struct PinholeFit {
  CameraIntrinsics camera; ///< its size is that of the cloud
  double deviation = 0;    ///< RMS of the larger axis [px]; infinite with hardly a point
};

PinholeFit
fitPinhole(const ColorCloud& cloud);

/** Why no camera took the points; empty when one did. */
std::string
faultOf(const PinholeFit& fit);

} // namespace bundle_icp
