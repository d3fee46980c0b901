// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <Eigen/Core>
#include <pcl/PolygonMesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace bundle_icp {

/** Triangles with shared vertices. Each list except `triangles` has one entry per vertex. Lists
 *  other than `vertices` and `triangles` may be empty: their data is then unknown. */
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;           ///< world frame [m]
  std::vector<Eigen::Vector3f> normals;            ///< unit length, towards the cameras
  std::vector<std::array<std::uint8_t, 3>> colors; ///< red, green, blue
  /** Weight of all measurements of a vertex together, 1 = a frontal measurement at 1 m. */
  std::vector<float> weights;
  /** Standard deviation of the vertex along its normal [m], see MeshOptions. */
  std::vector<float> deviations;
  std::vector<std::array<std::uint32_t, 3>> triangles; ///< counter-clockwise from outside
};

/** The mesh in PCL's form: x, y, z, and those of normal_x, normal_y, normal_z, rgb, weight and
 *  std_deviation that the mesh has. Normals come with a curvature of 0: without curvature
 *  pcl::fromPCLPointCloud2() would warn about points with normals.
 *  \throws pcl::BadArgumentException when a list has another size than `vertices`, or a triangle
 *  names a vertex that does not exist. */
BUNDLE_ICP_EXPORT pcl::PolygonMesh
toPolygonMesh(const SurfaceMesh& mesh);

/** The mesh with the fields of toPolygonMesh(); other fields are lost. Polygons of more than three
 *  corners are cut into triangles around the first corner; polygons of fewer corners are left out.
 *  \throws pcl::BadArgumentException when the cloud has no x, y, z as 32 bit floats or less data
 *  than it declares, or a polygon names a vertex that does not exist. */
BUNDLE_ICP_EXPORT SurfaceMesh
toSurfaceMesh(const pcl::PolygonMesh& mesh);

} // namespace bundle_icp
