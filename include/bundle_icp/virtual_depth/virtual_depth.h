// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <opencv2/core/mat.hpp>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <string>
#include <vector>

namespace bundle_icp {

/** A depth image prepared once for every later use: I_i^d of the paper with what its
 * weight w needs. All images have the size of `camera`. */
struct DepthView {
  CameraIntrinsics camera;
  cv::Mat depth;   ///< CV_32FC1 [m], NaN = not measured
  cv::Mat normals; ///< CV_32FC3, unit, camera frame, towards the camera; NaN = unknown
  cv::Mat weight;  ///< CV_32FC1, w = 1 / sigma^2 [1/m^2] of the depth along the axis,
                   ///< falling with viewing angle and towards depth edges; 0 where there
                   ///< is no depth
};

/** How makeDepthView() and renderVirtualDepth() work. */
struct BUNDLE_ICP_EXPORT VirtualDepthOptions {
  /** Pixels nearer to an edge than this weigh less, linearly to 0 at the edge [px]. */
  double edge_distance = 3;
  /** Surfaces steeper than this to the ray do not take part [degrees]. */
  double max_view_angle = 80;
  /** Measurements within this many sigma of the nearest surface are averaged with it;
   * those further behind are occluded by it. */
  double merge_sigmas = 4;
  /** Threads to use, 0 = all. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Prepares a depth image: optional reduction by an integer factor (edge-preserving:
 * the average of those pixels of a block that belong to its surface), normals, weights.
 *  \param depth CV_32FC1, metres, NaN = not measured, of the size of `camera`. */
BUNDLE_ICP_EXPORT DepthView
makeDepthView(const cv::Mat& depth, const CameraIntrinsics& camera, int reduction = 1,
              const VirtualDepthOptions& options = {});

/** A registered neighbour that takes part in a virtual depth map. */
struct RegisteredView {
  const DepthView* view = nullptr;
  Pose world_from_camera = Pose::Identity();
};

/** The virtual depth map I_vir^d of equation (6): what a noise-free camera would have
 * seen. */
struct VirtualDepth {
  CameraIntrinsics camera;
  Pose world_from_camera = Pose::Identity();
  cv::Mat depth;    ///< CV_32FC1 [m], NaN = nothing seen
  cv::Mat normals;  ///< CV_32FC3, unit, camera frame, towards the camera
  cv::Mat variance; ///< CV_32FC1 [m^2], of the averaged depth
};

/** Fuses the registered views into the depth map seen from `world_from_virtual`,
 * equation (6): each measurement is warped into the virtual view and averaged with its
 * weight; where surfaces overlap the nearest wins; holes between warped samples are
 * closed by rendering the depth image's mesh rather than its points. The result does
 * not depend on the number of threads nor on the order of the views (up to rounding).
 */
BUNDLE_ICP_EXPORT VirtualDepth
renderVirtualDepth(const std::vector<RegisteredView>& views, const CameraIntrinsics& camera,
                   const Pose& world_from_virtual, const VirtualDepthOptions& options = {});

/** The virtual depth as the organized target cloud of BundleICP: world frame, metres,
 * with normals; `curvature` carries the standard deviation of the depth [m]; NaN where
 * there is nothing. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
toPointCloud(const VirtualDepth& virtual_depth);

/** A depth view as the organized source cloud of BundleICP: camera frame, metres, with
 * normals; `curvature` carries the standard deviation of the depth [m]; NaN where there
 * is nothing. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
toPointCloud(const DepthView& view);

} // namespace bundle_icp
