// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

#include <functional>
#include <vector>

namespace bundle_icp {

/** The numbers of a file that holds one matrix, row by row.
 *  \throws pcl::IOException naming the file when it holds another number of numbers. */
std::vector<double>
readNumbers(const std::string& path, std::size_t count);

/** The pose of a matrix of 4x4 that was written with few digits.
 *  \param source names the matrix in messages
 *  \throws pcl::IOException when it is not a rigid motion. */
Pose
poseOf(const Eigen::Matrix4d& matrix, const std::string& source);

/** The pose in a file of 16 numbers, row by row.
 *  \throws pcl::IOException naming the file and the reason. */
Pose
readPoseFile(const std::string& path);

/** The pose of a camera in OpenCV's convention (y down, z forward) from one in OpenGL's (y up,
 *  z back), the world being the same. */
Pose
fromOpenGl(const Pose& world_from_camera);

/** Makes the median of the intrinsics of all frames those of the recording, and says how far they
 *  differ. */
void
takeMedianCamera(const std::vector<CameraIntrinsics>& cameras, const std::string& source,
                 Recording& recording);

/** Adds the pose that `read` gives to the recording's; a pose that is none is skipped.
 *  \param source names the pose in messages */
void
takePose(double timestamp, const std::string& source, const std::function<Pose()>& read,
         Recording& recording);

/** Brings the poses in the order of time, and marks them as an estimate of their maker. */
void
finishEstimatedPoses(const std::string& maker, Recording& recording);

} // namespace bundle_icp
