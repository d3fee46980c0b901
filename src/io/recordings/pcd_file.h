// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <string>

namespace bundle_icp {

/** Reads an organized .pcd file with the fields x, y, z and rgb or rgba, of any of the three
 *  encodings. PCL's own reader is in a library that brings VTK.
 *  \throws pcl::IOException naming the file and what is wrong with it. */
pcl::PointCloud<pcl::PointXYZRGBA>
readOrganizedPcd(const std::string& path);

/** Where the file says that the cloud was taken from.
 *  \throws pcl::IOException as readOrganizedPcd(). */
Pose
readPcdViewpoint(const std::string& path);

} // namespace bundle_icp
