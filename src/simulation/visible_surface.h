// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scene.h"

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <vector>

namespace bundle_icp {
namespace simulation {

/** The surface that cameras at `poses` see: the first point of all pixels in each voxel of edge
 *  `spacing` [m], in the order of the poses, with normals towards free space. */
pcl::PointCloud<pcl::PointNormal>::Ptr
visibleSurface(const Scene& scene, const CameraIntrinsics& camera, const std::vector<Pose>& poses,
               double spacing, int num_threads);

} // namespace simulation
} // namespace bundle_icp
