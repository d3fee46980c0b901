// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/mesh_io.h>

#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/exceptions.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <csignal>
#include <sys/resource.h>

using namespace bundle_icp;

namespace {

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

pcl::PointCloud<pcl::PointXYZRGBNormal>
fourPoints()
{
  pcl::PointCloud<pcl::PointXYZRGBNormal> cloud;
  for (int i = 0; i < 4; ++i) {
    pcl::PointXYZRGBNormal point;
    point.getVector3fMap() = Eigen::Vector3f(i & 1, i >> 1, 0.25f * i);
    point.getNormalVector3fMap() = Eigen::Vector3f(0.6f, 0, -0.8f);
    point.r = static_cast<std::uint8_t>(10 + i);
    point.g = 200;
    point.b = 255;
    cloud.push_back(point);
  }
  return cloud;
}

} // namespace

TEST(MeshIO, PclReadsBackWhatWasWritten)
{
  const TemporaryFolder folder;
  const auto cloud = fourPoints();
  writeMesh(folder.path("mesh.ply"), meshOf(cloud));
  pcl::PolygonMesh mesh;
  ASSERT_EQ(pcl::io::loadPLYFile(folder.path("mesh.ply"), mesh), 0);
  ASSERT_EQ(mesh.polygons.size(), 2u);
  EXPECT_EQ(mesh.polygons[1].vertices, (pcl::Indices{2, 1, 3}));
  pcl::PointCloud<pcl::PointXYZRGBNormal> read;
  pcl::fromPCLPointCloud2(mesh.cloud, read);
  ASSERT_EQ(read.size(), cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(read[i].getVector3fMap(), cloud[i].getVector3fMap());
    EXPECT_EQ(read[i].getNormalVector3fMap(), cloud[i].getNormalVector3fMap());
    EXPECT_EQ(read[i].getRGBVector3i(), cloud[i].getRGBVector3i());
  }
}

TEST(MeshIO, HeaderDeclaresExactlyWhatIsThere)
{
  const TemporaryFolder folder;
  writeMesh(folder.path("all.ply"), meshOf(fourPoints()));
  const std::string all = readText(folder.path("all.ply"));
  const std::string header = all.substr(0, all.find("end_header\n") + 11);
  EXPECT_EQ(all.size(), header.size() + 4 * (6 * 4 + 3) + 2 * (1 + 3 * 4));
  for (const char* line :
       {"format binary_", "element vertex 4\n", "property float nx\n",
        "property uchar red\n", "element face 2\n",
        "property list uchar int vertex_indices\n"})
    EXPECT_NE(header.find(line), std::string::npos) << line;

  pcl::PointCloud<pcl::PointXYZ> bare;
  bare.resize(4);
  writeMesh(folder.path("bare.ply"), meshOf(bare));
  const std::string text = readText(folder.path("bare.ply"));
  EXPECT_EQ(text.find("property float nx"), std::string::npos);
  EXPECT_EQ(text.find("property uchar red"), std::string::npos);
  EXPECT_EQ(text.size(), text.find("end_header\n") + 11 + 4 * 12 + 2 * 13);
}

TEST(MeshIO, EmptyMeshIsAValidFile)
{
  const TemporaryFolder folder;
  pcl::PolygonMesh mesh;
  pcl::toPCLPointCloud2(pcl::PointCloud<pcl::PointXYZRGBNormal>(), mesh.cloud);
  writeMesh(folder.path("empty.ply"), mesh);
  EXPECT_NE(readText(folder.path("empty.ply")).find("element vertex 0\n"),
            std::string::npos);
}

TEST(MeshIO, BadMeshesAreRefusedAndTheOldFileStays)
{
  const TemporaryFolder folder;
  writeText(folder.path("mesh.ply"), "precious");
  const auto refusal = [&folder](const pcl::PolygonMesh& mesh) {
    return messageOf<pcl::BadArgumentException>(
        [&] { writeMesh(folder.path("mesh.ply"), mesh); });
  };
  pcl::PolygonMesh mesh = meshOf(fourPoints());
  mesh.polygons[0].vertices[1] = 4;
  EXPECT_CONTAINS(refusal(mesh), "vertex 4 of 4");
  mesh = meshOf(fourPoints());
  mesh.polygons[0].vertices.resize(256, 0);
  EXPECT_CONTAINS(refusal(mesh), "256 corners");
  mesh = meshOf(fourPoints());
  mesh.cloud.data.resize(10);
  EXPECT_CONTAINS(refusal(mesh), "less data");
  EXPECT_CONTAINS(refusal({}), "no x, y, z");
  EXPECT_EQ(readText(folder.path("mesh.ply")), "precious");
}

TEST(MeshIO, UnwritablePlacesAreNamed)
{
  const TemporaryFolder folder;
  const std::string message = messageOf<pcl::IOException>(
      [&] { writeMesh(folder.path("missing/mesh.ply"), meshOf(fourPoints())); });
  EXPECT_CONTAINS(message, "missing/mesh.ply");
}

TEST(MeshIO, AFullDiskIsNoticedAndTheOldFileStays)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("mesh.ply");
  writeText(path, "old");
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.resize(10000);
  // A limit on the size of files acts as a disk with 4 KiB left.
  rlimit old_limit{}, limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  limit = {4096, old_limit.rlim_max};
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &limit);
  const std::string message =
      messageOf<pcl::IOException>([&] { writeMesh(path, meshOf(cloud)); });
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_CONTAINS(message, path + ": cannot write");
  EXPECT_EQ(readText(path), "old");
}
