// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/registration/visual_pose.h>

#include <opencv2/core/types.hpp>

#include <optional>
#include <vector>

namespace bundle_icp {

/** The pose world_from_source from which `pixels` show `points` [m, world frame], lists of equal
 *  length: RANSAC over minimal samples with a fixed seed, refined over the inliers. Only the
 *  reprojection error counts, so rmse and scale stay unset. Unset when too few points agree. */
std::optional<RigidAlignment>
estimatePnPPose(const CameraIntrinsics& camera, const std::vector<cv::Point2d>& pixels,
                const std::vector<Eigen::Vector3d>& points);

} // namespace bundle_icp
