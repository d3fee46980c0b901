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

/** A depth image prepared once for all later uses: I_i^d of the paper with the data for its weight
 *  w. All images have the size of `camera`. */
struct DepthView {
  CameraIntrinsics camera;
  cv::Mat depth;   ///< CV_32FC1 [m], NaN = not measured
  cv::Mat normals; ///< CV_32FC3, unit, camera frame, towards the camera; NaN = unknown
  cv::Mat weight;  ///< CV_32FC1, w = 1 / sigma^2 [1/m^2] of the depth along the axis; lower at
                   ///< steep viewing angles and near depth edges; 0 = no depth
};

/** How makeDepthView() and renderVirtualDepth() work. */
struct BUNDLE_ICP_EXPORT VirtualDepthOptions {
  /** Distance from a depth edge within which weights fall linearly to 0 at the edge [px]. */
  double edge_distance = 3;
  /** Largest angle of a surface's normal to the ray [degrees]; steeper surfaces are ignored. */
  double max_view_angle = 80;
  /** Measurements within this many sigma of the nearest surface are averaged with it; measurements
   *  farther behind are occluded. */
  double merge_sigmas = 4;
  /** Threads to use, 0 = all. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Prepares a depth image: optional reduction by an integer factor, normals, weights. The reduction
 *  preserves edges: it averages those pixels of a block that belong to the block's surface.
 *  \param depth CV_32FC1, metres, NaN = not measured, of the size of `camera`. */
BUNDLE_ICP_EXPORT DepthView
makeDepthView(const cv::Mat& depth, const CameraIntrinsics& camera, int reduction = 1,
              const VirtualDepthOptions& options = {});

/** A registered neighbour of a virtual depth map. */
struct RegisteredView {
  const DepthView* view = nullptr;
  Pose world_from_camera = Pose::Identity();
};

/** The virtual depth map I_vir^d of equation (6): the depth that a noise-free camera would see. */
struct VirtualDepth {
  CameraIntrinsics camera;
  Pose world_from_camera = Pose::Identity();
  cv::Mat depth;    ///< CV_32FC1 [m], NaN = nothing seen
  cv::Mat normals;  ///< CV_32FC3, unit, camera frame, towards the camera
  cv::Mat variance; ///< CV_32FC1 [m^2], variance of the averaged depth
};

/** Fuses the registered views into the depth map seen from `world_from_virtual`, equation (6). Each
 *  measurement is warped into the virtual view and averaged with its weight. Where surfaces
 *  overlap, the nearest wins. Rendering the depth image's mesh rather than its points closes holes
 *  between warped samples. The result does not depend on the number of threads nor, up to rounding,
 *  on the order of the views. */
BUNDLE_ICP_EXPORT VirtualDepth
renderVirtualDepth(const std::vector<RegisteredView>& views, const CameraIntrinsics& camera,
                   const Pose& world_from_virtual, const VirtualDepthOptions& options = {});

/** The virtual depth as the organized target cloud of BundleICP: world frame, metres, with normals.
 *  `curvature` holds the standard deviation of the depth [m]. NaN = nothing seen. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
toPointCloud(const VirtualDepth& virtual_depth);

/** A view as the organized source cloud of BundleICP: camera frame, metres, with normals.
 *  `curvature` holds the standard deviation of the depth [m]. NaN = no depth. */
BUNDLE_ICP_EXPORT pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
toPointCloud(const DepthView& view);

} // namespace bundle_icp
