// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/simulation/synthetic_scan.h>

#include <cmath>

/** Options of a scan in small images. */
inline bundle_icp::SyntheticScanOptions
smallScan()
{
  bundle_icp::SyntheticScanOptions options;
  options.num_frames = 12;
  options.frame_rate = 2;
  options.width = 160;
  options.height = 120;
  options.focal_length = 131;
  return options;
}

/** A scan without faults in small images. */
inline const bundle_icp::SyntheticScan&
exactScan()
{
  static const bundle_icp::SyntheticScan scan(smallScan());
  return scan;
}

/** Largest distance of the points of a depth image from the true surface [m]. */
inline double
largestDistance(const bundle_icp::SyntheticScan& scan, const cv::Mat& depth,
                const bundle_icp::CameraIntrinsics& camera,
                const bundle_icp::Pose& world_from_camera)
{
  double largest = 0;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const double z = depth.at<float>(y, x);
      const double distance = scan.distanceToSurface(world_from_camera * camera.unproject(x, y, z));
      largest = std::isfinite(distance) ? std::max(largest, distance) : 1e9;
    }
  return largest;
}

/** True when two images have the same bits. */
inline bool
areSame(const cv::Mat& a, const cv::Mat& b)
{
  if (a.size() != b.size() || a.type() != b.type())
    return false;
  for (int y = 0; y < a.rows; ++y)
    if (!std::equal(a.ptr(y), a.ptr(y) + a.cols * a.elemSize(), b.ptr(y)))
      return false;
  return true;
}
