// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/mesh_layout.h"

#include <cstdint>

namespace bundle_icp {
namespace {

/** By pcl::PCLPointField's numbers. */
struct Type {
  const char* name;
  std::size_t size;
};
constexpr Type TYPES[] = {{"", 0},    {"char", 1}, {"uchar", 1}, {"short", 2}, {"ushort", 2},
                          {"int", 4}, {"uint", 4}, {"float", 4}, {"double", 8}};

/** What of a field goes into the file. */
struct Property {
  std::string name;
  Type type;
  std::size_t offset;
};

std::vector<Property>
propertiesOf(const pcl::PCLPointCloud2& cloud)
{
  std::vector<Property> properties;
  for (const pcl::PCLPointField& field : cloud.fields) {
    const bool is_color = field.name == "rgb" || field.name == "rgba";
    // toPolygonMesh() adds a curvature of 0, which says nothing.
    if (field.count > 1 || field.name == "_" || field.name == "curvature" || field.datatype < 1 ||
        field.datatype >= std::size(TYPES) ||
        field.offset + TYPES[field.datatype].size > cloud.point_step)
      continue;
    if (is_color) // 0xaarrggbb
      for (const auto& [name, byte] : {std::pair{"red", 2}, {"green", 1}, {"blue", 0}})
        properties.push_back({name, TYPES[pcl::PCLPointField::UINT8],
                              field.offset + std::size_t(isLittleEndian() ? byte : 3 - byte)});
    else if (field.name.compare(0, 7, "normal_") == 0)
      properties.push_back({"n" + field.name.substr(7), TYPES[field.datatype], field.offset});
    else
      properties.push_back({field.name, TYPES[field.datatype], field.offset});
  }
  return properties;
}

std::string
header(const pcl::PolygonMesh& mesh, const std::vector<Property>& properties)
{
  std::string text = std::string("ply\nformat binary_") + (isLittleEndian() ? "little" : "big") +
                     "_endian 1.0\ncomment metres\nelement vertex " +
                     std::to_string(numVertices(mesh)) + "\n";
  for (const Property& property : properties)
    text += std::string("property ") + property.type.name + " " + property.name + "\n";
  if (!mesh.polygons.empty())
    text += "element face " + std::to_string(mesh.polygons.size()) +
            "\nproperty list uchar int vertex_indices\n";
  return text + "end_header\n";
}

} // namespace

// Not by pcl::PLYWriter, which brings VTK, does not notice a full disk and leaves out what is known
// of vertices.
void
encodePLY(const pcl::PolygonMesh& mesh, std::ostream& file)
{
  const std::vector<Property> properties = propertiesOf(mesh.cloud);
  std::string bytes = header(mesh, properties);
  const char* vertex = reinterpret_cast<const char*>(mesh.cloud.data.data());
  for (std::size_t i = 0; i < numVertices(mesh); ++i, vertex += mesh.cloud.point_step) {
    for (const Property& property : properties)
      bytes.append(vertex + property.offset, property.type.size);
    flushWhenLarge(bytes, file);
  }
  for (const pcl::Vertices& polygon : mesh.polygons) {
    bytes += char(polygon.vertices.size());
    for (const auto vertex_index : polygon.vertices) {
      const auto number = std::int32_t(vertex_index);
      bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
    }
    flushWhenLarge(bytes, file);
  }
  flush(bytes, file);
}

} // namespace bundle_icp
