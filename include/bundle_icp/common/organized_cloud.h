// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace bundle_icp {

/** The frame that an organized cloud shows, such as PCL's grabbers give: the point in column u and
 *  row v is pixel (u, v). Points are in the frame of the camera [m]: x right, y down, z forward.
 *  Points that are not finite, and those with z <= 0, have no depth.
 *  \param camera camera of the cloud, without distortion, see intrinsicsOf()
 *  \param timestamp of the cloud [s]; pcl::PointCloud::header has microseconds
 *  \throws pcl::BadArgumentException when the cloud is not organized, has not the size of the
 *  camera, or when most of its points lie far from their pixels: then they are in another frame. */
BUNDLE_ICP_EXPORT RGBDFrame
toFrame(const pcl::PointCloud<pcl::PointXYZRGBA>& cloud, const CameraIntrinsics& camera,
        double timestamp);

/** The pinhole camera that fits the points of an organized cloud best, with the cloud's size. Any
 *  cloud of a recording serves that has depth in all parts of the image.
 *  \throws pcl::BadArgumentException when the cloud is not organized, has hardly a point, or when
 *  the points are not those of a camera that looks along z, x right and y down. */
BUNDLE_ICP_EXPORT CameraIntrinsics
intrinsicsOf(const pcl::PointCloud<pcl::PointXYZRGBA>& cloud);

} // namespace bundle_icp
