// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Meshes that cannot be read or written.
#include <bundle_icp/io/mesh_io.h>

#include "io/meshes.h"
#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <csignal>
#include <sys/resource.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST(MeshIO, DamagedFilesAreRefusedWithTheReason)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("mesh.ply");
  const auto refusal = [&path](const std::string& text) {
    writeText(path, text);
    return messageOf<pcl::IOException>([&path] { readMesh(path); });
  };
  const std::string start = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  EXPECT_CONTAINS(refusal("solid\n"), path + ": cannot be read as PLY: it does not begin");
  EXPECT_CONTAINS(refusal(start), "ends within its header");
  EXPECT_CONTAINS(refusal("ply\nformat ascii 1.0\nelement vertex\nend_header\n"),
                  "header is damaged");
  EXPECT_CONTAINS(refusal("ply\nformat ascii 1.0\nelement vertex 9999999999\nend_header\n"),
                  "header is damaged");
  EXPECT_CONTAINS(refusal("ply\nformat binary 1.0\nelement vertex 0\nend_header\n"),
                  "unknown format 'binary'");
  EXPECT_CONTAINS(refusal("ply\nelement vertex 0\nend_header\n"), "header names no format");
  EXPECT_CONTAINS(refusal(start + "property half y\nend_header\n"), "unknown type 'half'");
  EXPECT_CONTAINS(refusal(start + "end_header\n1\n"), "truncated");
  EXPECT_CONTAINS(refusal(start + "end_header\n1\nx\n"), "a number is missing");
  EXPECT_CONTAINS(refusal(start + face + "end_header\n1\n2\n1 2\n"), "names vertex 2 of 2");
  EXPECT_CONTAINS(refusal(start + face + "end_header\n1\n2\n1 -1\n"), "names vertex");
  EXPECT_CONTAINS(refusal(start + face + "end_header\n1\n2\n1000000000 1\n"), "truncated");
  writeMesh(path, meshOf(fourPoints()));
  const std::string whole = readText(path);
  EXPECT_CONTAINS(refusal(whole.substr(0, whole.size() - 1)), "truncated");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { readMesh(folder.path("none.ply")); }),
                  "none.ply: cannot be opened");
}

TEST(MeshIO, BadMeshesAreRefusedAndTheOldFileStays)
{
  const TemporaryFolder folder;
  writeText(folder.path("mesh.ply"), "precious");
  const auto refusal = [&folder](const pcl::PolygonMesh& mesh) {
    return messageOf<pcl::BadArgumentException>([&] { writeMesh(folder.path("mesh.ply"), mesh); });
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

TEST(MeshIO, OtherExtensionsAreRefused)
{
  const TemporaryFolder folder;
  for (const char* name : {"mesh.dae", "mesh", "mesh.ply.gz"})
    EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                        [&] { writeMesh(folder.path(name), meshOf(fourPoints())); }),
                    "must end in .ply, .obj or .stl");
  pcl::PolygonMesh empty;
  pcl::toPCLPointCloud2(pcl::PointCloud<pcl::PointXYZ>(), empty.cloud);
  EXPECT_CONTAINS(
      messageOf<pcl::BadArgumentException>([&] { writeMesh(folder.path("empty.obj"), empty); }),
      "without vertices");
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
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.resize(10000);
  pcl::PolygonMesh mesh = meshOf(cloud);
  mesh.polygons.resize(1000, mesh.polygons[0]);
  for (const std::string& format : meshFormats()) {
    const std::string path = folder.path("mesh." + format);
    writeText(path, "old");
    // A limit on the size of files acts as a disk with 4 KiB left.
    rlimit old_limit{}, limit{};
    getrlimit(RLIMIT_FSIZE, &old_limit);
    limit = {4096, old_limit.rlim_max};
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
    const std::string message = messageOf<pcl::IOException>([&] { writeMesh(path, mesh); });
    setrlimit(RLIMIT_FSIZE, &old_limit);
    std::signal(SIGXFSZ, old_handler);
    EXPECT_CONTAINS(message, path + ": cannot write");
    EXPECT_EQ(readText(path), "old");
  }
}
