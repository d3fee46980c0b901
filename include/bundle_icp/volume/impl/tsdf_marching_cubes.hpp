// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/volume/tsdf_marching_cubes.h>

#include <bundle_icp/common/exceptions.h>

#include <pcl/point_types.h>
#include <pcl/type_traits.h>
// The base class is instantiated where it is used, so that users need not link
// pcl_surface.
#include <pcl/surface/impl/marching_cubes.hpp>
#include <pcl/surface/impl/reconstruction.hpp>

namespace bundle_icp {

template <typename PointNT>
TSDFMarchingCubes<PointNT>::TSDFMarchingCubes()
{
  // The base class refuses to work without an input cloud, of which nothing is used.
  typename PointCloud::Ptr unused(new PointCloud);
  unused->resize(1);
  this->setInputCloud(unused);
  this->check_tree_ = false;
}

template <typename PointNT>
void
TSDFMarchingCubes<PointNT>::performReconstruction(pcl::PolygonMesh& output)
{
  const pcl::PCLHeader header = output.header;
  output = toPolygonMesh(extract());
  output.header = header;
}

template <typename PointNT>
SurfaceMesh
TSDFMarchingCubes<PointNT>::extract()
{
  if (!volume_)
    throw BadArgumentException("TSDFMarchingCubes: no volume; call setVolume() first");
  MeshOptions options = options_;
  options.iso_level = this->iso_level_;
  return extractSurface(*volume_, options, &report_);
}

template <typename PointNT>
void
TSDFMarchingCubes<PointNT>::performReconstruction(PointCloud& points,
                                                  std::vector<pcl::Vertices>& polygons)
{
  const SurfaceMesh mesh = extract();
  points.resize(mesh.vertices.size());
  points.is_dense = true;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    PointNT& point = points[i];
    point.getVector3fMap() = mesh.vertices[i];
    point.getNormalVector3fMap() = mesh.normals[i];
    if constexpr (pcl::traits::has_color<PointNT>::value) {
      point.r = mesh.colors[i][0];
      point.g = mesh.colors[i][1];
      point.b = mesh.colors[i][2];
      point.a = 255;
    }
  }
  polygons.resize(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    polygons[i].vertices.assign(mesh.triangles[i].begin(), mesh.triangles[i].end());
}

} // namespace bundle_icp

#define PCL_INSTANTIATE_TSDFMarchingCubes(T)                                                       \
  template class BUNDLE_ICP_EXPORT bundle_icp::TSDFMarchingCubes<T>;
