// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

#include <nlohmann/json_fwd.hpp>

namespace bundle_icp {

/** Takes from a calibration of any known form what it says of a recording: intrinsics of colour and
 *  depth, the pose of the depth camera, units of depth. The keys are those of Open3D, librealsense,
 *  OpenCV and ROS; docs/recordings.md lists them.
 *  \param path for messages
 *  \throws pcl::IOException naming the file and the keys that it lacks, or a wrong one. */
void
takeCalibration(const nlohmann::json& json, const std::string& path, Recording& recording);

/** takeCalibration() of a JSON file in UTF-8 or UTF-16.
 *  \throws pcl::IOException naming the file when it cannot be read or is not JSON. */
void
readJsonCalibration(const std::string& path, Recording& recording);

/** takeCalibration() of a YAML or XML file as OpenCV and ROS write it.
 *  \throws pcl::IOException naming the file when it cannot be read or is neither. */
void
readYamlCalibration(const std::string& path, Recording& recording);

} // namespace bundle_icp
