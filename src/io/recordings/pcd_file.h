// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <opencv2/core/mat.hpp>

#include <string>

namespace bundle_icp {

/** A point cloud of PCL that has rows and columns, as images. */
struct OrganizedCloud {
  cv::Mat color; ///< CV_8UC3, BGR
  cv::Mat xyz;   ///< CV_32FC3 [m], NaN where there is no point
};

/** Reads an organized .pcd file with the fields x, y, z and rgb or rgba, of any of the three
 *  encodings. PCL's own reader is in a library that brings VTK.
 *  \throws pcl::IOException naming the file and what is wrong with it. */
OrganizedCloud
readOrganizedPcd(const std::string& path);

/** Where the file says that the cloud was taken from.
 *  \throws pcl::IOException as readOrganizedPcd(). */
Pose
readPcdViewpoint(const std::string& path);

} // namespace bundle_icp
