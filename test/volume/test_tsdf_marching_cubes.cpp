// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "rendered_frame.h"

#include <bundle_icp/volume/tsdf_marching_cubes.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

std::shared_ptr<TSDFVolume>
fuseSphere()
{
  TSDFOptions options;
  options.voxel_size = 0.01;
  auto volume = std::make_shared<TSDFVolume>(options);
  for (const Pose& pose : posesAllAround(1.0))
    volume->integrate(render(sphere(0.3), pose), smallCamera(), pose);
  return volume;
}

// What a user's own class sees of the base class.
class Derived : public TSDFMarchingCubes<pcl::PointXYZINormal> {};

} // namespace

TEST(TSDFMarchingCubes, WorksThroughTheBaseClassWithoutInputCloud)
{
  const auto volume = fuseSphere();
  TSDFMarchingCubes<pcl::PointXYZRGBNormal> cubes;
  cubes.setVolume(volume);
  pcl::MarchingCubes<pcl::PointXYZRGBNormal>& base = cubes;
  pcl::PolygonMesh mesh;
  base.reconstruct(mesh);
  const SurfaceMesh expected = extractSurface(*volume);
  ASSERT_EQ(mesh.polygons.size(), expected.triangles.size());

  pcl::PointCloud<pcl::PointXYZRGBNormal> points;
  pcl::fromPCLPointCloud2(mesh.cloud, points);
  ASSERT_EQ(points.size(), expected.vertices.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(points[i].getVector3fMap(), expected.vertices[i]);
    ASSERT_EQ(points[i].getNormalVector3fMap(), expected.normals[i]);
    EXPECT_NEAR(points[i].r, 150, 2);
    EXPECT_NEAR(points[i].g, 100, 2);
    EXPECT_NEAR(points[i].b, 50, 2);
  }
  // Again into the same mesh: nothing is left over.
  base.reconstruct(mesh);
  EXPECT_EQ(mesh.polygons.size(), expected.triangles.size());
}

TEST(TSDFMarchingCubes, OtherPointTypesAndCloudsWithPolygons)
{
  const auto volume = fuseSphere();
  TSDFMarchingCubes<pcl::PointNormal> cubes;
  cubes.setVolume(volume);
  pcl::PointCloud<pcl::PointNormal> points;
  std::vector<pcl::Vertices> polygons;
  cubes.reconstruct(points, polygons);
  EXPECT_EQ(points.size(), extractSurface(*volume).vertices.size());
  EXPECT_FALSE(polygons.empty());

  Derived derived;
  derived.setVolume(volume);
  pcl::PolygonMesh mesh;
  derived.reconstruct(mesh);
  EXPECT_EQ(mesh.polygons.size(), polygons.size());
}

TEST(TSDFMarchingCubes, HonoursIsoLevelAndOptions)
{
  TSDFMarchingCubes<pcl::PointNormal> cubes;
  cubes.setVolume(fuseSphere());
  cubes.setIsoLevel(0.5f);
  pcl::PointCloud<pcl::PointNormal> points;
  std::vector<pcl::Vertices> polygons;
  cubes.reconstruct(points, polygons);
  ASSERT_FALSE(points.empty());
  EXPECT_GT(points[0].getVector3fMap().norm(), 0.31f);
  MeshOptions options;
  options.min_weight = 1000;
  cubes.setMeshOptions(options);
  cubes.reconstruct(points, polygons);
  EXPECT_TRUE(points.empty());
  EXPECT_TRUE(polygons.empty());
}

TEST(TSDFMarchingCubes, RefusesToWorkWithoutVolume)
{
  TSDFMarchingCubes<pcl::PointNormal> cubes;
  pcl::PolygonMesh mesh;
  EXPECT_THROW(cubes.reconstruct(mesh), pcl::BadArgumentException);
  cubes.setVolume(fuseSphere());
  MeshOptions options;
  options.min_weight = -1;
  cubes.setMeshOptions(options);
  EXPECT_THROW(cubes.reconstruct(mesh), pcl::BadArgumentException);
}
