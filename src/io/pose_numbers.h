// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** Pose of the depth camera in the frame of the colour camera, of `tx ty tz [qx qy qz qw]` [m] or
 *  of a matrix of 3x4 or 4x4, row by row.
 *  \param source for messages
 *  \throws pcl::IOException naming the source: another number of values, no rotation, or cameras
 *  more than 1 m apart. */
Pose
depthToColor(const std::vector<double>& numbers, const std::string& source);

} // namespace bundle_icp
