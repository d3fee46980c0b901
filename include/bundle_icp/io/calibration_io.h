// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>

#include <string>

namespace bundle_icp {

/** Writes a calibration as JSON: value, standard deviation and unit of each parameter
 * by its calibrationName(), `depth_scale`, and the camera that all of it corrects. The
 * file appears whole or not at all (written beside, then renamed). \param camera the
 * uncorrected one: RGBDDataset::camera() \throws pcl::IOException naming file and
 * reason. */
BUNDLE_ICP_EXPORT void
writeCalibration(const std::string& path, const Calibration& calibration,
                 const CameraIntrinsics& camera);

/** Reads what writeCalibration() wrote. A parameter that the file lacks is 0.
 *  \param camera the uncorrected one to which the calibration will be applied
 *  \throws pcl::IOException naming file and reason: file missing, no JSON, a parameter
 * that is unknown, not a number or out of the bounds of Calibration::isValid(), made
 * for another image size or another camera. */
BUNDLE_ICP_EXPORT Calibration
readCalibration(const std::string& path, const CameraIntrinsics& camera);

/** The depth noise of a sensor.
 *  \param sensor a name that depthNoiseOf() knows, or a JSON file such as
 *         {"constant": 0.0012, "quadratic": 0.0019, "offset": 0.4}, the members of DepthNoise
 *  \throws pcl::IOException naming file and reason: neither a name nor a file, no JSON, a
 *          number missing or impossible. */
BUNDLE_ICP_EXPORT DepthNoise
readDepthNoise(const std::string& sensor);

} // namespace bundle_icp
