// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <opencv2/core/mat.hpp>
#include <pcl/PolygonMesh.h>

#include <vector>

namespace bundle_icp {

/** Picture of a mesh on white, CV_8UC3 BGR, rendered without a display: vertex colours
 *  (grey when there are none), slight shading by the vertex normals, the backs of faces
 *  left out, so that one looks into rooms through their walls. Anti-aliased.
 *  \param camera size and focal length of the picture [px]
 *  \param world_from_camera where it is taken from
 *  \throws pcl::BadArgumentException for impossible intrinsics, a pose that is not
 *          rigid, a mesh without x, y, z, or a face that names a vertex that does not
 *          exist. */
BUNDLE_ICP_EXPORT cv::Mat
renderMeshPreview(const pcl::PolygonMesh& mesh, const CameraIntrinsics& camera,
                  const Pose& world_from_camera);

/** A pose for renderMeshPreview(): looks the way the scan's cameras looked on average,
 *  from behind them, far enough that nearly all of the mesh is in the picture. Cameras
 *  that looked all around give an oblique view from above.
 *  \param world_from_cameras poses of the scan's cameras, at least one
 *  \throws pcl::BadArgumentException for no poses or impossible intrinsics. */
BUNDLE_ICP_EXPORT Pose
choosePreviewPose(const pcl::PolygonMesh& mesh, const CameraIntrinsics& camera,
                  const std::vector<Pose>& world_from_cameras);

/** Plot of the camera centres from above and from the side, CV_8UC3 BGR on white,
 *  1280x640, with axes in metres. Up is where the cameras' tops point on average.
 *  \param world_from_cameras poses in the order in which they are joined, at least one
 *  \param truth true poses in the same world frame (align them first); may be empty
 *  \throws pcl::BadArgumentException for no poses or a pose that is not finite. */
BUNDLE_ICP_EXPORT cv::Mat
renderTrajectoryPreview(const std::vector<Pose>& world_from_cameras,
                        const std::vector<Pose>& truth = {});

} // namespace bundle_icp
