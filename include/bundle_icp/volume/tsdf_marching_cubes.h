// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/volume/extract_surface.h>

#include <pcl/surface/marching_cubes.h>

#include <memory>

namespace bundle_icp {

/** extractSurface() behind PCL's interface: a pcl::MarchingCubes that takes its field from a
 *  TSDFVolume instead of an input cloud.
 *
 *   \code
 *   bundle_icp::TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
 *   cubes.setVolume(volume); // std::shared_ptr<const TSDFVolume>
 *   pcl::PolygonMesh mesh;
 *   cubes.reconstruct(mesh);
 *   \endcode
 *
 *  PointNT must have normals; its colour is filled if it has one. A pcl::PolygonMesh holds all that
 *  is known of a vertex, see toPolygonMesh(). setIsoLevel() takes truncations. Input cloud, grid
 *  resolution and percentage of the base class have no effect. Library instantiations:
 *  pcl::PointNormal, pcl::PointXYZRGBNormal. */
template <typename PointNT>
class TSDFMarchingCubes : public pcl::MarchingCubes<PointNT> {
public:
  using Ptr = std::shared_ptr<TSDFMarchingCubes<PointNT>>;
  using ConstPtr = std::shared_ptr<const TSDFMarchingCubes<PointNT>>;
  using PointCloud = pcl::PointCloud<PointNT>;

  TSDFMarchingCubes();

  /** Sets the volume to mesh. Without a volume reconstruct() throws pcl::BadArgumentException. */
  void
  setVolume(std::shared_ptr<const TSDFVolume> volume)
  {
    volume_ = std::move(volume);
  }

  /** Sets all options except the iso level, which setIsoLevel() sets. */
  void
  setMeshOptions(const MeshOptions& options)
  {
    options_ = options;
  }

  const MeshOptions&
  getMeshOptions() const
  {
    return options_;
  }

  /** What cleaning and decimation did in the last reconstruct(). */
  const MeshReport&
  getMeshReport() const
  {
    return report_;
  }

protected:
  void
  voxelizeData() override
  {
  }

  void
  performReconstruction(pcl::PolygonMesh& output) override;

  void
  performReconstruction(PointCloud& points, std::vector<pcl::Vertices>& polygons) override;

  std::string
  getClassName() const override
  {
    return "TSDFMarchingCubes";
  }

private:
  SurfaceMesh
  extract();

  std::shared_ptr<const TSDFVolume> volume_;
  MeshOptions options_;
  MeshReport report_;
};

} // namespace bundle_icp

#include <bundle_icp/volume/impl/tsdf_marching_cubes.hpp>

#if !defined(PCL_NO_PRECOMPILE) && !defined(BUNDLE_ICP_TSDF_MARCHING_CUBES_CPP_)
extern template class bundle_icp::TSDFMarchingCubes<pcl::PointNormal>;
extern template class bundle_icp::TSDFMarchingCubes<pcl::PointXYZRGBNormal>;
#endif
