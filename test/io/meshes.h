// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <pcl/PolygonMesh.h>
#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace bundle_icp::test {

template <typename PointT>
pcl::PolygonMesh
meshOf(const pcl::PointCloud<PointT>& cloud)
{
  pcl::PolygonMesh mesh;
  pcl::toPCLPointCloud2(cloud, mesh.cloud);
  mesh.polygons.resize(2);
  mesh.polygons[0].vertices = {0, 1, 2};
  mesh.polygons[1].vertices = {2, 1, 3};
  return mesh;
}

inline pcl::PointCloud<pcl::PointXYZRGBNormal>
fourPoints()
{
  pcl::PointCloud<pcl::PointXYZRGBNormal> cloud;
  for (int i = 0; i < 4; ++i) {
    pcl::PointXYZRGBNormal point;
    point.getVector3fMap() = Eigen::Vector3f(i & 1, i >> 1, 0.25f * i);
    point.getNormalVector3fMap() = Eigen::Vector3f(0.6f, 0, -0.8f);
    point.r = std::uint8_t(10 + i);
    point.g = 200;
    point.b = 255;
    cloud.push_back(point);
  }
  return cloud;
}

} // namespace bundle_icp::test
