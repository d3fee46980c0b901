// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/mesh_layout.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/io/mesh_io.h>

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/filesystem/path.hpp>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

// Not by PCL's own readers and writers: pcl_io brings VTK.
namespace bundle_icp {
namespace {

[[noreturn]] void
refuse(const std::string& path, const std::string& reason)
{
  throw BadArgumentException("writeMesh " + path + ": " + reason);
}

VertexLayout
findLayout(const std::string& path, const pcl::PCLPointCloud2& cloud)
{
  VertexLayout layout;
  for (const pcl::PCLPointField& field : cloud.fields) {
    const int offset = int(field.offset);
    if (field.offset + 4 > cloud.point_step)
      continue;
    if (field.name == "rgb" || field.name == "rgba")
      layout.color = offset;
    if (field.datatype != pcl::PCLPointField::FLOAT32)
      continue;
    if (field.name == "x" || field.name == "y" || field.name == "z")
      layout.position[field.name[0] - 'x'] = offset;
    else if (field.name == "normal_x" || field.name == "normal_y" || field.name == "normal_z")
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
    refuse(path,
           "the cloud holds less data than its " + std::to_string(vertices) + " vertices need");
  for (const pcl::Vertices& polygon : mesh.polygons) {
    if (polygon.vertices.size() > 255)
      refuse(path, "a face has " + std::to_string(polygon.vertices.size()) +
                       " corners, at most 255 can be written");
    for (const auto vertex : polygon.vertices)
      if (std::size_t(vertex) >= vertices)
        refuse(path,
               "a face names vertex " + std::to_string(vertex) + " of " + std::to_string(vertices));
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
    std::ofstream file(temporary_path, std::ios::binary);
    if (format == ".ply")
      encodePLY(mesh, file);
    else
      (format == ".obj" ? encodeOBJ : encodeSTL)(mesh, layout, file);
    file.close();
    if (!file)
      throw IOException("writeMesh " + path + ": cannot write all of it");
  });
}

pcl::PolygonMesh
readMesh(const std::string& path)
{
  const std::string bytes = readBytes(path, std::uint64_t(16) << 30);
  try {
    return decodePLY(bytes);
  }
  catch (const std::runtime_error& error) {
    throw IOException(path + ": cannot be read as PLY: " + error.what());
  }
}

} // namespace bundle_icp
