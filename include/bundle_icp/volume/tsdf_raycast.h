// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/volume/tsdf_volume.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace bundle_icp {

/** The surface of a volume as a camera sees it: an organized cloud of the camera's size, the target
 *  of frame-to-model ICP.
 *
 *  Each pixel's ray is followed to the first change of sign from front to back; the point is
 *  interpolated there (Newcombe et al., KinectFusion, ISMAR 2011, section 3.4). Only the range of
 *  allocated blocks is searched. Points are in the world frame [m], with the volume's colour and
 *  unit normals towards the camera, from the gradient. NaN = no surface or its back. The result
 *  does not depend on the number of threads.
 *  \param camera camera of the cloud, without distortion
 *  \param num_threads 0 = all
 *  \throws pcl::BadArgumentException for impossible intrinsics, distortion, or a pose not rigid. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
raycast(const TSDFVolume& volume, const CameraIntrinsics& camera, const Pose& world_from_camera,
        int num_threads = 0);

} // namespace bundle_icp
