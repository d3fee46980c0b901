// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/mesh/surface_mesh.h>

#include "io/meshes.h"
#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/exceptions.h>
#include <pcl/io/obj_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <locale>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

void
expectSame(const pcl::PolygonMesh& read, const pcl::PointCloud<pcl::PointXYZRGBNormal>& cloud,
           const std::vector<pcl::Vertices>& polygons)
{
  const SurfaceMesh mesh = toSurfaceMesh(read);
  ASSERT_EQ(mesh.vertices.size(), cloud.size());
  ASSERT_EQ(mesh.normals.size(), cloud.size());
  ASSERT_EQ(mesh.colors.size(), cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(mesh.vertices[i], cloud[i].getVector3fMap());
    EXPECT_EQ(mesh.normals[i], cloud[i].getNormalVector3fMap());
    EXPECT_EQ(mesh.colors[i], (std::array<std::uint8_t, 3>{cloud[i].r, cloud[i].g, cloud[i].b}));
  }
  ASSERT_EQ(read.polygons.size(), polygons.size());
  for (std::size_t i = 0; i < polygons.size(); ++i)
    EXPECT_EQ(read.polygons[i].vertices, polygons[i].vertices);
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

TEST(MeshIO, ReadsBackWhatItWrote)
{
  const TemporaryFolder folder;
  const pcl::PolygonMesh mesh = meshOf(fourPoints());
  writeMesh(folder.path("mesh.ply"), mesh);
  expectSame(readMesh(folder.path("mesh.ply")), fourPoints(), mesh.polygons);
}

TEST(MeshIO, ReadsWhatPclWrites)
{
  const TemporaryFolder folder;
  const pcl::PolygonMesh mesh = meshOf(fourPoints());
  pcl::io::savePLYFile(folder.path("text.ply"), mesh, 9);
  pcl::io::savePLYFileBinary(folder.path("binary.ply"), mesh);
  for (const char* name : {"text.ply", "binary.ply"})
    expectSame(readMesh(folder.path(name)), fourPoints(), mesh.polygons);
  // With the element "camera", and without
  pcl::io::savePLYFileASCII(folder.path("text.ply"), fourPoints());
  pcl::io::savePLYFileBinary(folder.path("binary.ply"), fourPoints());
  pcl::PLYWriter().write(folder.path("plain.ply"), fourPoints(), true, false);
  for (const char* name : {"text.ply", "binary.ply", "plain.ply"})
    expectSame(readMesh(folder.path(name)), fourPoints(), {});
}

TEST(MeshIO, ReadsOtherTypesAndByteOrders)
{
  const TemporaryFolder folder;
  writeText(
      folder.path("mesh.ply"),
      "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement vertex 3\r\n"
      "property double x\r\nproperty double y\r\nproperty double z\r\nproperty uchar quality\r\n"
      "element face 1\r\n"
      "property list uint8 uint vertex_index\r\nend_header\r\n0 0 1e-1 7\r\n1 0 .5 8\r\n"
      "0 1 -2 9\r\n3 0 1 2\r\n");
  const pcl::PolygonMesh text = readMesh(folder.path("mesh.ply"));
  pcl::PointCloud<pcl::PointXYZ> places;
  pcl::fromPCLPointCloud2(text.cloud, places);
  ASSERT_EQ(places.size(), 3u);
  EXPECT_EQ(places[0].z, 0.1f);
  EXPECT_EQ(places[2].getVector3fMap(), Eigen::Vector3f(0, 1, -2));
  EXPECT_EQ(pcl::getFieldIndex(text.cloud, "quality"), 3);
  ASSERT_EQ(text.polygons.size(), 1u);
  EXPECT_EQ(text.polygons[0].vertices, (pcl::Indices{0, 1, 2}));

  writeText(folder.path("big.ply"),
            std::string("ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\n"
                        "property short y\nproperty char z\nend_header\n") +
                std::string("\x3f\x80\0\0\1\2\xff", 7));
  pcl::fromPCLPointCloud2(readMesh(folder.path("big.ply")).cloud, places);
  ASSERT_EQ(places.size(), 1u);
  EXPECT_EQ(places[0].getVector3fMap(), Eigen::Vector3f(1, 258, -1));
}

TEST(MeshIO, DoesNotDependOnTheLocale)
{
  struct Comma : std::numpunct<char> {
    char
    do_decimal_point() const override
    {
      return ',';
    }
    std::string
    do_grouping() const override
    {
      return "\1";
    }
  };
  const TemporaryFolder folder;
  pcl::PolygonMesh mesh = meshOf(fourPoints());
  mesh.polygons.resize(1234, mesh.polygons[0]);
  const auto write = [&](const std::string& name) {
    for (const std::string& format : meshFormats())
      writeMesh(folder.path(name + "." + format), mesh);
    return readMesh(folder.path(name + ".ply")).polygons.size();
  };
  write("classic");
  const std::locale old = std::locale::global(std::locale(std::locale::classic(), new Comma));
  const std::size_t polygons = write("comma");
  std::locale::global(old);
  EXPECT_EQ(polygons, 1234u);
  for (const std::string& format : meshFormats())
    EXPECT_EQ(readText(folder.path("comma." + format)), readText(folder.path("classic." + format)));
}

TEST(MeshIO, HeaderDeclaresExactlyWhatIsThere)
{
  const TemporaryFolder folder;
  writeMesh(folder.path("all.ply"), meshOf(fourPoints()));
  const std::string all = readText(folder.path("all.ply"));
  const std::string header = all.substr(0, all.find("end_header\n") + 11);
  EXPECT_EQ(all.size(), header.size() + 4 * (6 * 4 + 3) + 2 * (1 + 3 * 4));
  for (const char* line :
       {"format binary_", "element vertex 4\n", "property float nx\n", "property uchar red\n",
        "element face 2\n", "property list uchar int vertex_indices\n"})
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
  EXPECT_NE(readText(folder.path("empty.ply")).find("element vertex 0\n"), std::string::npos);
}

TEST(MeshIO, PlyHoldsWeightsAndDeviations)
{
  const TemporaryFolder folder;
  pcl::PolygonMesh mesh = meshOf(fourPoints());
  // Two more fields in the bytes that a point has to spare.
  const float weight = 7, deviation = 0.002f;
  for (const char* name : {"weight", "std_deviation"}) {
    pcl::PCLPointField field;
    field.name = name;
    field.offset = mesh.cloud.point_step - (name[0] == 'w' ? 8 : 4);
    field.datatype = pcl::PCLPointField::FLOAT32;
    field.count = 1;
    mesh.cloud.fields.push_back(field);
    for (std::size_t i = 0; i < 4; ++i)
      std::memcpy(&mesh.cloud.data[i * mesh.cloud.point_step + field.offset],
                  name[0] == 'w' ? &weight : &deviation, 4);
  }
  writeMesh(folder.path("mesh.ply"), mesh);
  pcl::PCLPointCloud2 read;
  ASSERT_EQ(pcl::io::loadPLYFile(folder.path("mesh.ply"), read), 0);
  for (const auto& [name, expected] :
       {std::make_pair("weight", weight), std::make_pair("std_deviation", deviation)}) {
    const int index = pcl::getFieldIndex(read, name);
    ASSERT_GE(index, 0) << name;
    float value = 0;
    std::memcpy(&value, &read.data[3 * read.point_step + read.fields[index].offset], 4);
    EXPECT_EQ(value, expected);
  }
}

TEST(MeshIO, PclReadsObj)
{
  const TemporaryFolder folder;
  const auto cloud = fourPoints();
  writeMesh(folder.path("mesh.OBJ"), meshOf(cloud));
  pcl::PolygonMesh mesh;
  ASSERT_EQ(pcl::io::loadOBJFile(folder.path("mesh.OBJ"), mesh), 0);
  ASSERT_EQ(mesh.polygons.size(), 2u);
  EXPECT_EQ(mesh.polygons[1].vertices, (pcl::Indices{2, 1, 3}));
  pcl::PointCloud<pcl::PointXYZ> places;
  pcl::PointCloud<pcl::Normal> normals;
  pcl::fromPCLPointCloud2(mesh.cloud, places);
  ASSERT_EQ(places.size(), cloud.size());
  EXPECT_GE(pcl::getFieldIndex(mesh.cloud, "normal_x"), 0);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    EXPECT_EQ(places[i].getVector3fMap(), cloud[i].getVector3fMap());

  // Colours follow the positions: 12, 200 and 255 of 255
  EXPECT_CONTAINS(readText(folder.path("mesh.OBJ")), "\nv 0 1 0.5 0.047058824 0.78431374 1\n");

  pcl::PointCloud<pcl::PointXYZ> bare;
  bare.resize(4);
  writeMesh(folder.path("bare.obj"), meshOf(bare));
  EXPECT_EQ(readText(folder.path("bare.obj")).find("vn "), std::string::npos);
  EXPECT_CONTAINS(readText(folder.path("bare.obj")), "\nv 0 0 0\n");
}

TEST(MeshIO, StlHoldsTheTriangles)
{
  const TemporaryFolder folder;
  pcl::PolygonMesh mesh = meshOf(fourPoints());
  mesh.polygons.resize(3);
  mesh.polygons[2].vertices = {0, 1, 3, 2};
  writeMesh(folder.path("mesh.stl"), mesh);
  const std::string bytes = readText(folder.path("mesh.stl"));
  ASSERT_EQ(bytes.size(), 84 + 4 * 50u);
  EXPECT_NE(bytes.substr(0, 5), "solid");
  std::uint32_t count = 0;
  std::memcpy(&count, &bytes[80], 4);
  EXPECT_EQ(count, 4u);
  const auto cloud = fourPoints();
  const int corners[4][3] = {{0, 1, 2}, {2, 1, 3}, {0, 1, 3}, {0, 3, 2}};
  for (int t = 0; t < 4; ++t) {
    float values[12];
    std::memcpy(values, &bytes[84 + 50 * t], sizeof(values));
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(Eigen::Vector3f::Map(values + 3 + 3 * i), cloud[corners[t][i]].getVector3fMap());
    const Eigen::Vector3f normal = Eigen::Vector3f::Map(values);
    const Eigen::Vector3f first =
        Eigen::Vector3f::Map(values + 6) - Eigen::Vector3f::Map(values + 3);
    EXPECT_NEAR(normal.norm(), 1, 1e-6);
    EXPECT_NEAR(normal.dot(first), 0, 1e-6);
  }
}

TEST(MeshIO, ColoursBeyondAByteAreCutToOne)
{
  const TemporaryFolder folder;
  writeText(folder.path("points.ply"), "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                       "property float y\nproperty float z\nproperty float red\n"
                                       "property float green\nproperty float blue\nend_header\n"
                                       "0 0 1 3e6 255 256\n0 1 1 -1 -1e30 0.5\n1 1 1 nan 7 8\n");
  pcl::PointCloud<pcl::PointXYZRGB> points;
  pcl::fromPCLPointCloud2(readMesh(folder.path("points.ply")).cloud, points);
  const auto colorOf = [&](std::size_t i) {
    return std::vector<int>{points[i].r, points[i].g, points[i].b};
  };
  EXPECT_EQ(colorOf(0), (std::vector<int>{255, 255, 255}));
  EXPECT_EQ(colorOf(1), (std::vector<int>{0, 0, 0}));
  EXPECT_EQ(colorOf(2), (std::vector<int>{0, 7, 8}));
}

TEST(MeshIO, ReadsAColourThatIsOneNumber)
{
  const TemporaryFolder folder;
  const std::string start = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
                            "property float y\nproperty float z\nproperty ";
  // 0x0a141e in either type.
  for (const std::string& rgb :
       {std::string("uint rgb|660510"), std::string("float rgb|9.2557e-40")}) {
    const std::size_t bar = rgb.find('|');
    const std::string number = rgb.substr(bar + 1);
    writeText(folder.path("points.ply"), start + rgb.substr(0, bar) + "\nend_header\n0 0 1 " +
                                             number + "\n0 1 2 " + number + "\n");
    pcl::PointCloud<pcl::PointXYZRGB> points;
    pcl::fromPCLPointCloud2(readMesh(folder.path("points.ply")).cloud, points);
    ASSERT_EQ(points.size(), 2u) << rgb;
    EXPECT_EQ(points[1].getVector3fMap(), Eigen::Vector3f(0, 1, 2)) << rgb;
    EXPECT_EQ(int(points[1].r), 10) << rgb;
    EXPECT_EQ(int(points[1].g), 20) << rgb;
  }
}
