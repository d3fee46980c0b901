// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** Takes intrinsics, and where it says them the units of depth and the camera of depth, from a file
 *  of a known name in the folder: `intrinsics.txt` (`fx fy cx cy [k1 k2 p1 p2 k3]`, or a matrix of
 *  3x3 or 4x4; optionally lines `depth_scale UNITS_PER_METRE`, `depth_intrinsics fx fy cx cy [k1
 *  k2 p1 p2 k3]` and `depth_to_color tx ty tz [qx qy qz qw]`), `intrinsic.json`,
 *  `camera_info.yaml` and the like. What is wrong with the file becomes
 *  Recording::calibration_fault.
 *  \return false when there is none. */
bool
readCalibrationFile(const std::string& folder, Recording& recording);

/** Intrinsics from a file that holds nothing but their matrix, row by row.
 *  \param side of the matrix, 3 or 4
 *  \throws pcl::IOException naming the file and the reason. */
CameraIntrinsics
readCameraMatrix(const std::string& path, std::size_t side);

/** As readCalibrationFile(), from the `_info.txt` or `info.txt` that the recorder of ScanNet and
 *  BundleFusion writes. */
bool
readSensorInfo(const std::string& folder, Recording& recording);

/** Files in the folder whose names say that they hold a calibration; for messages. */
std::vector<std::string>
possibleCalibrationFiles(const std::string& folder);

} // namespace bundle_icp
