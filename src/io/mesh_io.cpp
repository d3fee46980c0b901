// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/io/mesh_io.h>

#include <pcl/exceptions.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

// Not pcl::io::savePLYFileBinary: it does not notice a full disk.
namespace bundle_icp {
namespace {

/** Where a vertex has what, in bytes; -1 = absent. */
struct VertexLayout {
  int x = -1, y = -1, z = -1, normal[3] = {-1, -1, -1}, rgb = -1;

  bool
  hasNormals() const
  {
    return normal[0] >= 0 && normal[1] >= 0 && normal[2] >= 0;
  }
};

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
    if (field.name == "x")
      layout.x = offset;
    else if (field.name == "y")
      layout.y = offset;
    else if (field.name == "z")
      layout.z = offset;
    else if (field.name == "normal_x" || field.name == "normal_y" ||
             field.name == "normal_z")
      layout.normal[field.name.back() - 'x'] = offset;
  }
  if (layout.x < 0 || layout.y < 0 || layout.z < 0)
    refuse(path, "the vertices have no x, y, z as 32 bit floats");
  return layout;
}

std::size_t
numVertices(const pcl::PolygonMesh& mesh)
{
  return std::size_t(mesh.cloud.width) * mesh.cloud.height;
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
               std::vector<char>& bytes)
{
  for (std::size_t i = 0; i < std::size_t(cloud.width) * cloud.height; ++i) {
    const std::uint8_t* const vertex = cloud.data.data() + i * cloud.point_step;
    for (const int offset : {layout.x, layout.y, layout.z})
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
  }
}

void
appendFaces(const std::vector<pcl::Vertices>& polygons, std::vector<char>& bytes)
{
  for (const pcl::Vertices& polygon : polygons) {
    bytes.push_back(static_cast<char>(polygon.vertices.size()));
    for (const auto vertex : polygon.vertices) {
      const auto number = static_cast<std::int32_t>(vertex);
      append(&number, sizeof(number), bytes);
    }
  }
}

} // namespace

void
writeMesh(const std::string& path, const pcl::PolygonMesh& mesh)
{
  const VertexLayout layout = findLayout(path, mesh.cloud);
  checkMesh(path, mesh);
  writeAtomically(path, [&](const std::string& temporary_path) {
    std::vector<char> bytes;
    const std::string text = header(mesh, layout);
    bytes.reserve(text.size() + numVertices(mesh) * 27 + mesh.polygons.size() * 13);
    append(text.data(), text.size(), bytes);
    appendVertices(mesh.cloud, layout, bytes);
    appendFaces(mesh.polygons, bytes);
    std::ofstream file(temporary_path, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file)
      throw pcl::IOException("writeMesh " + path + ": cannot write " +
                             std::to_string(bytes.size()) + " bytes");
  });
}

} // namespace bundle_icp
