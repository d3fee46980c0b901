// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** A camera pose and its time. */
struct TimedPose {
  double timestamp = 0;                      ///< [s]
  Pose world_from_camera = Pose::Identity(); ///< metres
};

/** Poses in ascending order of time stamps; all stamps differ. */
using Trajectory = std::vector<TimedPose>;

/** The pose nearest in time, if it is not farther away than `max_difference` [s]. */
BUNDLE_ICP_EXPORT std::optional<Pose>
poseAt(const Trajectory& trajectory, double timestamp, double max_difference);

/** Reads a trajectory in TUM format: lines of `timestamp tx ty tz qx qy qz qw`, '#' for comments.
 *  Lines are sorted by time; of lines with equal stamps the last counts.
 *  \throws pcl::IOException naming file and line: file missing or empty, a line that is not eight
 *  numbers, NaN or infinity, a quaternion that is not of unit length (1e-2). */
BUNDLE_ICP_EXPORT Trajectory
readTrajectory(const std::string& path);

/** Writes TUM format, with microseconds and enough digits to read back 0.1 micrometre. The file
 *  appears whole or not at all.
 *  \throws pcl::IOException naming file and reason. */
BUNDLE_ICP_EXPORT void
writeTrajectory(const std::string& path, const Trajectory& trajectory);

/** Reads time stamps [s] in the order of the file: the first column of a list with '#' for
 *  comments, such as `rgb.txt` of a TUM folder.
 *  \throws pcl::IOException naming file and line: file missing or empty, not a finite number. */
BUNDLE_ICP_EXPORT std::vector<double>
readTimestamps(const std::string& path);

} // namespace bundle_icp
