// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/pose.h>

#include <string>

namespace bundle_icp {

/** Writes a calibration as JSON: value, standard deviation and unit of each parameter under its
 *  calibrationName(), `depth_scale`, and the uncorrected camera. The file appears whole or not at
 *  all.
 *  \param camera the uncorrected camera: RGBDDataset::camera()
 *  \throws pcl::IOException naming file and reason. */
BUNDLE_ICP_EXPORT void
writeCalibration(const std::string& path, const Calibration& calibration,
                 const CameraIntrinsics& camera);

/** Reads a file of writeCalibration(). A parameter that the file lacks is 0.
 *  \param camera the uncorrected camera to which the calibration will be applied
 *  \throws pcl::IOException naming file and reason: file missing, not JSON, a parameter that is
 *  unknown, not a number or outside the bounds of Calibration::isValid(), another image size or
 *  camera. */
BUNDLE_ICP_EXPORT Calibration
readCalibration(const std::string& path, const CameraIntrinsics& camera);

/** Reads the depth noise of a sensor.
 *  \param sensor a name that depthNoiseOf() knows, or a JSON file with the members of DepthNoise,
 *  such as {"constant": 0.0012, "quadratic": 0.0019, "offset": 0.4}
 *  \throws pcl::IOException naming file and reason: neither a name nor a file, not JSON, a number
 *  missing or impossible. */
BUNDLE_ICP_EXPORT DepthNoise
readDepthNoise(const std::string& sensor);

/** Reads the pose of the depth camera in the frame of the colour camera [m]:
 *  x_color = T x_depth.
 *  \param text `tx,ty,tz[,qx,qy,qz,qw]`, or a text file with these numbers or a matrix of 4x4 or
 *  3x4, row by row
 *  \throws pcl::IOException naming text or file and the reason: neither numbers nor a file, no
 *  rotation, cameras more than 1 m apart. */
BUNDLE_ICP_EXPORT Pose
readDepthToColor(const std::string& text);

} // namespace bundle_icp
