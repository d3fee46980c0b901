// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/oriented_box.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** How findObjectRegion() separates a plane from the objects on it. */
struct BUNDLE_ICP_EXPORT ObjectRegionOptions {
  /** Points are joined in cells of this edge [m], 0.001 to 0.1. */
  double cell_size = 0.01;
  double max_depth = 3; ///< points farther from the camera are ignored [m], 0.2 to 100
  /** Points within this distance belong to the plane [m], 0.001 to 0.2. */
  double plane_tolerance = 0.015;
  /** Minimum share of all points that must lie on the plane, 0 to 1. */
  double min_plane_share = 0.1;
  double min_height = 0.025; ///< points closer to the plane are ignored [m], above plane_tolerance
  double max_height = 1.0;   ///< points higher above the plane are ignored [m], above min_height
  /** Cells nearer than this belong to one object [m], 1 to 20 cells. */
  double cluster_tolerance = 0.03;
  std::size_t min_cells = 40; ///< minimum number of cells of an object, at least 1
  /** A frame looks at objects within this angle of its axis [rad], 0.01 to 1. */
  double view_angle = 0.2;
  /** Margin of the box around the object on each side, and below the plane [m], 0 to 1. */
  double margin = 0.02;

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** The object on the dominant plane. */
struct ObjectRegion {
  bool is_found = false;
  std::string reason; ///< why no object was found, with numbers
  OrientedBox box;    ///< z along the plane's normal, away from the plane
  /** n . x + d = 0 in the world [m], n of unit length towards the cameras. */
  Eigen::Vector4d plane = Eigen::Vector4d::Zero();
  std::size_t looking_frames = 0; ///< frames that look at this object more than at any other
  std::size_t num_frames = 0;     ///< number of all frames
};

/** Finds the object of a scan in three steps: the plane that fills most of the frames
 *  (pcl::SACSegmentation), the objects on the plane within its outline
 *  (pcl::ExtractPolygonalPrismData, pcl::EuclideanClusterExtraction), and the object that most
 *  frames look at. The box stands on the plane and is the smallest around the object. Apart
 *  from rounding, the result does not depend on the order of the frames.
 *  \param clouds one cloud per frame, in its camera frame [m]; NaN is ignored. Some thousand points
 *  per frame, evenly spaced in the image, are enough: samplePoints()
 *  \param world_from_cameras the frames' poses
 *  \throws pcl::BadArgumentException for invalid options, no frames, a different number of poses,
 *  or poses that are not rigid. A missing plane or object is a result, not an error. */
BUNDLE_ICP_EXPORT ObjectRegion
findObjectRegion(const std::vector<pcl::PointCloud<pcl::PointXYZ>>& clouds,
                 const std::vector<Pose>& world_from_cameras,
                 const ObjectRegionOptions& options = {});

/** Points in the camera frame [m]: each `step`-th pixel of each `step`-th row that has depth and is
 *  not at a depth edge. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZ>
samplePoints(const RGBDFrame& frame, const CameraIntrinsics& camera, int step = 6);

} // namespace bundle_icp
