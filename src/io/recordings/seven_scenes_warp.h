// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** True for the depth camera of 7-Scenes (585 px, 640x480), whose colour is not
 * registered. */
bool
isSevenScenesDepthCamera(const CameraIntrinsics& camera);

/** Warps a colour image of 7-Scenes into its depth camera, to which the poses belong.
 *
 *  The colour camera has a focal length f of 526.5 px (depth: 585) and sits 25 mm
 * beside the depth camera: u_c = f/585 (u - 320) + 320 - 0.025 f / z, v_c = f/585 (v -
 * 240) + 240 - 2. Where depth is missing, the nearest measured one stands in. \param
 * color CV_8UC3, as recorded. \param depth CV_16UC1 [mm], as recorded. */
cv::Mat
warpSevenScenesColor(const cv::Mat& color, const cv::Mat& depth);

} // namespace bundle_icp
