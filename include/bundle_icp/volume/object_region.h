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

/** How findObjectRegion() tells a plane from what stands on it. */
struct BUNDLE_ICP_EXPORT ObjectRegionOptions {
  /** Points are joined in cells of this edge [m], 0.001 to 0.1. */
  double cell_size = 0.01;
  double max_depth = 3; ///< points farther from the camera are not looked at [m], 0.2 to 100
  /** Points within this distance belong to the plane [m], 0.001 to 0.2. */
  double plane_tolerance = 0.015;
  /** The plane holds at least this share of all points, 0 to 1. */
  double min_plane_share = 0.1;
  double min_height = 0.025; ///< of what stands on the plane [m], above plane_tolerance
  double max_height = 1.0;   ///< above it nothing counts [m], above min_height
  /** Cells nearer than this belong to one object [m], 1 to 20 cells. */
  double cluster_tolerance = 0.03;
  std::size_t min_cells = 40; ///< of an object, at least 1
  /** A frame looks at what lies within this angle of its axis [rad], 0.01 to 1. */
  double view_angle = 0.2;
  /** The box is larger than the object by so much on each side, and reaches as far below
   *  the plane [m], 0 to 1. */
  double margin = 0.02;

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** The object on the dominant plane. */
struct ObjectRegion {
  bool is_found = false;
  std::string reason; ///< why none was found, with numbers
  OrientedBox box;    ///< z along the plane's normal, away from the plane
  /** n . x + d = 0 in the world [m], n of unit length towards the cameras. */
  Eigen::Vector4d plane = Eigen::Vector4d::Zero();
  std::size_t looking_frames = 0; ///< that look at it more than at any other
  std::size_t num_frames = 0;     ///< of all
};

/** Finds the object that a scan is about: the plane that fills most of the frames
 *  (pcl::SACSegmentation), what stands on it within its outline
 *  (pcl::ExtractPolygonalPrismData, pcl::EuclideanClusterExtraction), and of that what most
 *  frames look at. The box is the smallest one around it that stands on the plane. The result
 *  does not depend on the order of the frames beyond rounding.
 *  \param clouds one for each frame, in its camera frame [m]; NaN is ignored. Points evenly
 *         spaced in the image, some thousands a frame, are enough: samplePoints()
 *  \param world_from_cameras the frames' poses
 *  \throws pcl::BadArgumentException for invalid options, no frames, or another number of
 *          poses, and poses that are not rigid. That there is no plane or no object is a
 *          result. */
BUNDLE_ICP_EXPORT ObjectRegion
findObjectRegion(const std::vector<pcl::PointCloud<pcl::PointXYZ>>& clouds,
                 const std::vector<Pose>& world_from_cameras,
                 const ObjectRegionOptions& options = {});

/** Points of every `step`-th pixel of every `step`-th row that has depth, but for those at
 *  depth edges, in the camera frame [m]. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZ>
samplePoints(const RGBDFrame& frame, const CameraIntrinsics& camera, int step = 6);

} // namespace bundle_icp
