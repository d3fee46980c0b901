// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/mesh/surface_mesh.h>

#include <opencv2/core/mat.hpp>

#include <vector>

namespace bundle_icp {

/** Picture of a mesh on white, 1280x960, CV_8UC3 BGR. It shows nearly all of the mesh, as the
 *  scan's cameras saw it on average, from behind the cameras; obliquely from above when the cameras
 *  looked all around. Backs of faces are left out, so that walls do not hide rooms.
 *  \param world_from_cameras at least one */
cv::Mat
drawMesh(const SurfaceMesh& mesh, const std::vector<Pose>& world_from_cameras);

/** Picture of a mesh as a camera sees it, CV_8UC3 BGR of the camera's size, white where nothing is.
 *  Backs of faces are left out. */
cv::Mat
drawMesh(const SurfaceMesh& mesh, const CameraIntrinsics& camera, const Pose& world_from_camera);

/** Plot of the camera centres from above and from the side, 1280x640, CV_8UC3 BGR. Up is the mean
 *  direction of the cameras' tops.
 *  \param world_from_cameras in the order of the line through them, at least one */
cv::Mat
drawTrajectory(const std::vector<Pose>& world_from_cameras);

} // namespace bundle_icp
