// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/mesh_layout.h"

#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/io/mesh_io.h>

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem/path.hpp>
#include <pcl/exceptions.h>
#include <pcl/io/obj_io.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

// PLY not by pcl::io::savePLYFileBinary, which does not notice a full disk and leaves out what is
// known of vertices; STL not by pcl::io::savePolygonFileSTL, which needs VTK.
namespace bundle_icp {
namespace {

[[noreturn]] void
refuse(const std::string& path, const std::string& reason)
{
  throw pcl::BadArgumentException("writeMesh " + path + ": " + reason);
}

VertexLayout
findLayout(const std::string& path, const pcl::PCLPointCloud2& cloud)
{
  VertexLayout layout;
  for (const pcl::PCLPointField& field : cloud.fields) {
    const int offset = static_cast<int>(field.offset);
    if (field.offset + 4 > cloud.point_step)
      continue;
    if (field.name == "rgb" || field.name == "rgba")
      layout.rgb = offset;
    if (field.datatype != pcl::PCLPointField::FLOAT32)
      continue;
    if (field.name == "x" || field.name == "y" || field.name == "z")
      layout.position[field.name[0] - 'x'] = offset;
    else if (field.name == "weight")
      layout.weight = offset;
    else if (field.name == "std_deviation")
      layout.std_deviation = offset;
    else if (field.name == "normal_x" || field.name == "normal_y" ||
             field.name == "normal_z")
      layout.normal[field.name.back() - 'x'] = offset;
  }
  if (layout.position[0] < 0 || layout.position[1] < 0 || layout.position[2] < 0)
    refuse(path, "the vertices have no x, y, z as 32 bit floats");
  return layout;
}

void
checkMesh(const std::string& path, const pcl::PolygonMesh& mesh)
{
  const std::size_t vertices = numVertices(mesh);
  if (mesh.cloud.data.size() < vertices * mesh.cloud.point_step)
    refuse(path, "the cloud holds less data than its " + std::to_string(vertices) +
                     " vertices need");
  for (const pcl::Vertices& polygon : mesh.polygons) {
    if (polygon.vertices.size() > 255)
      refuse(path, "a face has " + std::to_string(polygon.vertices.size()) +
                       " corners, at most 255 can be written");
    for (const auto vertex : polygon.vertices)
      if (static_cast<std::size_t>(vertex) >= vertices)
        refuse(path, "a face names vertex " + std::to_string(vertex) + " of " +
                         std::to_string(vertices));
  }
}

void
checkForOBJ(const std::string& path, const pcl::PolygonMesh& mesh)
{
  if (numVertices(mesh) == 0)
    refuse(path, "a mesh without vertices cannot be written as OBJ");
  for (const pcl::Vertices& polygon : mesh.polygons)
    if (polygon.vertices.empty())
      refuse(path, "a face without corners cannot be written as OBJ");
}

std::string
header(const pcl::PolygonMesh& mesh, const VertexLayout& layout)
{
  const std::uint16_t one = 1;
  const bool little = *reinterpret_cast<const std::uint8_t*>(&one) == 1;
  std::string text = std::string("ply\nformat binary_") + (little ? "little" : "big") +
                     "_endian 1.0\ncomment metres\nelement vertex " +
                     std::to_string(numVertices(mesh)) +
                     "\nproperty float x\nproperty float y\nproperty float z\n";
  if (layout.hasNormals())
    text += "property float nx\nproperty float ny\nproperty float nz\n";
  if (layout.rgb >= 0)
    text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (layout.weight >= 0)
    text += "property float weight\n";
  if (layout.std_deviation >= 0)
    text += "property float std_deviation\n";
  return text + "element face " + std::to_string(mesh.polygons.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

void
append(const void* data, std::size_t size, std::vector<char>& bytes)
{
  const auto* const begin = static_cast<const char*>(data);
  bytes.insert(bytes.end(), begin, begin + size);
}

void
appendVertices(const pcl::PCLPointCloud2& cloud, const VertexLayout& layout,
               std::vector<char>& bytes, std::ostream& file)
{
  for (std::size_t i = 0; i < std::size_t(cloud.width) * cloud.height; ++i) {
    const std::uint8_t* const vertex = cloud.data.data() + i * cloud.point_step;
    for (const int offset : layout.position)
      append(vertex + offset, 4, bytes);
    if (layout.hasNormals())
      for (const int offset : layout.normal)
        append(vertex + offset, 4, bytes);
    if (layout.rgb >= 0) {
      std::uint32_t packed;
      std::memcpy(&packed, vertex + layout.rgb, sizeof(packed));
      const std::uint8_t color[3] = {std::uint8_t(packed >> 16),
                                     std::uint8_t(packed >> 8), std::uint8_t(packed)};
      append(color, sizeof(color), bytes);
    }
    for (const int offset : {layout.weight, layout.std_deviation})
      if (offset >= 0)
        append(vertex + offset, 4, bytes);
    flushWhenLarge(bytes, file);
  }
}

void
appendFaces(const std::vector<pcl::Vertices>& polygons, std::vector<char>& bytes,
            std::ostream& file)
{
  for (const pcl::Vertices& polygon : polygons) {
    bytes.push_back(static_cast<char>(polygon.vertices.size()));
    for (const auto vertex : polygon.vertices) {
      const auto number = static_cast<std::int32_t>(vertex);
      append(&number, sizeof(number), bytes);
    }
    flushWhenLarge(bytes, file);
  }
}

void
encodePLY(const pcl::PolygonMesh& mesh, const VertexLayout& layout, std::ostream& file)
{
  file << header(mesh, layout);
  std::vector<char> bytes;
  appendVertices(mesh.cloud, layout, bytes, file);
  appendFaces(mesh.polygons, bytes, file);
  flush(bytes, file);
}

/** What pcl::io::saveOBJFile() reads of a cloud, with the fields in the order that it relies on. */
pcl::PCLPointCloud2
cloudForOBJ(const pcl::PCLPointCloud2& cloud, const VertexLayout& layout)
{
  pcl::PCLPointCloud2 result = cloud;
  result.data.resize(std::size_t(cloud.width) * cloud.height * cloud.point_step);
  result.fields.clear();
  const auto add = [&result](const std::string& name, int offset) {
    pcl::PCLPointField field;
    field.name = name;
    field.offset = static_cast<std::uint32_t>(offset);
    field.datatype = pcl::PCLPointField::FLOAT32;
    field.count = 1;
    result.fields.push_back(field);
  };
  for (int i = 0; i < 3; ++i)
    add(std::string(1, char('x' + i)), layout.position[i]);
  for (int i = 0; i < 3 && layout.hasNormals(); ++i)
    add(std::string("normal_") + char('x' + i), layout.normal[i]);
  return result;
}

void
writeOBJ(const std::string& path,
         const std::string& temporary_path,
         const pcl::PolygonMesh& mesh,
         const VertexLayout& layout)
{
  pcl::PolygonMesh plain;
  plain.cloud = cloudForOBJ(mesh.cloud, layout);
  plain.polygons = mesh.polygons;
  const int result = pcl::io::saveOBJFile(temporary_path, plain, 9);
  // It does not notice a full disk; the last line tells.
  const std::string last_line = "# End of File\n";
  std::ifstream file(temporary_path, std::ios::binary);
  std::string end(last_line.size(), ' ');
  file.seekg(-std::streamoff(end.size()), std::ios::end);
  file.read(end.data(), std::streamsize(end.size()));
  if (result != 0 || !file || end != last_line)
    throw pcl::IOException("writeMesh " + path + ": cannot write all of it");
}

} // namespace

std::vector<std::string>
meshFormats()
{
  return {"ply", "obj", "stl"};
}

void
writeMesh(const std::string& path, const pcl::PolygonMesh& mesh)
{
  const std::string format =
      boost::to_lower_copy(boost::filesystem::path(path).extension().string());
  if (format != ".ply" && format != ".obj" && format != ".stl")
    refuse(path, "the name must end in .ply, .obj or .stl");
  const VertexLayout layout = findLayout(path, mesh.cloud);
  checkMesh(path, mesh);
  if (format == ".obj")
    checkForOBJ(path, mesh);
  writeAtomically(path, [&](const std::string& temporary_path) {
    if (format == ".obj") {
      writeOBJ(path, temporary_path, mesh, layout);
      return;
    }
    std::ofstream file(temporary_path, std::ios::binary);
    (format == ".ply" ? encodePLY : encodeSTL)(mesh, layout, file);
    file.close();
    if (!file)
      throw pcl::IOException("writeMesh " + path + ": cannot write all of it");
  });
}

} // namespace bundle_icp
