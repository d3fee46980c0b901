// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>
#include <bundle_icp/evaluation/error_statistics.h>

#include <pcl/PolygonMesh.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <functional>
#include <string>

namespace bundle_icp {

/** Options of surfaceError(). */
struct BUNDLE_ICP_EXPORT SurfaceErrorOptions {
  /** Alignment applied to the mesh first, for example that of the absolute trajectory error. */
  Pose truth_from_estimate = Pose::Identity();
  /** A true point this close to the mesh counts as reconstructed [m]. */
  double completeness_distance = 0.01;
  /** Spacing of the mesh's samples: one sample per square of this side [m], uniform by area. A
   *  smaller value is more exact and slower; at most half of completeness_distance. */
  double sample_spacing = 0.005;
  /** Distance [m] of a point to the true surface, for when a better one is known than that to the
   *  nearest true point. Several threads call it at once. */
  std::function<double(const Eigen::Vector3d&)> distance_to_truth;
  /** Threads; 0 = all. The result does not depend on it. */
  int num_threads = 0;

  bool
  isValid(std::string* error = nullptr) const;
};

/** How far a mesh is from the true surface. */
struct SurfaceError {
  /** Distance of the mesh to the true surface [m], sampled uniformly by area. */
  ErrorStatistics accuracy;
  /** Share of the true points that lie within completeness_distance of the mesh, 0 to 1. */
  double completeness = 0;
};

/** Compares a mesh with points of the true surface [m].
 *
 *  Without SurfaceErrorOptions::distance_to_truth, accuracy is the distance to the nearest true
 *  point. It then cannot fall below about 0.4 of the spacing of the true points.
 *  \throws pcl::BadArgumentException for invalid options, a mesh without x, y, z or without area,
 *  one with more area than 1e8 samples cover, polygons that name vertices which are not finite or
 *  do not exist, or a surface without a finite point. */
BUNDLE_ICP_EXPORT SurfaceError
surfaceError(const pcl::PolygonMesh& mesh, const pcl::PointCloud<pcl::PointXYZ>& surface,
             const SurfaceErrorOptions& options = {});

/** The same for true points with unit normals. Accuracy is the distance to the tangent plane of the
 *  nearest true point; on smooth surfaces the spacing of the points does not limit it. Beyond the
 *  edge of the true surface, accuracy is the distance to the point. */
BUNDLE_ICP_EXPORT SurfaceError
surfaceError(const pcl::PolygonMesh& mesh, const pcl::PointCloud<pcl::PointNormal>& surface,
             const SurfaceErrorOptions& options = {});

} // namespace bundle_icp
