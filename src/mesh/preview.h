// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>
#include <bundle_icp/mesh/surface_mesh.h>

#include <opencv2/core/mat.hpp>

#include <vector>

namespace bundle_icp {

/** Picture of a mesh on white, 1280x960, CV_8UC3 BGR: nearly all of it, seen as the scan's cameras
 *  saw it on average, from behind them; obliquely from above when they looked all around. The backs
 *  of faces are left out, so that one looks into rooms through their walls.
 *  \param world_from_cameras at least one */
cv::Mat
drawMesh(const SurfaceMesh& mesh, const std::vector<Pose>& world_from_cameras);

/** Plot of the camera centres from above and from the side, 1280x640, CV_8UC3 BGR. Up is where the
 *  cameras' tops point on average.
 *  \param world_from_cameras in the order in which they are joined, at least one */
cv::Mat
drawTrajectory(const std::vector<Pose>& world_from_cameras);

} // namespace bundle_icp
