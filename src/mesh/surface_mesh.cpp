// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_editing.h"

#include <bundle_icp/common/exceptions.h>

#include <cstring>
#include <limits>
#include <string>

namespace bundle_icp {
namespace {

/** Lays out the fields of a vertex one after the other. */
class CloudWriter {
public:
  CloudWriter(pcl::PCLPointCloud2& cloud, std::size_t size) : cloud_(cloud)
  {
    cloud_.height = 1;
    cloud_.width = std::uint32_t(size);
    cloud_.is_bigendian = false;
    cloud_.is_dense = true;
  }

  void
  add(const char* name)
  {
    pcl::PCLPointField field;
    field.name = name;
    field.offset = cloud_.point_step;
    field.datatype = pcl::PCLPointField::FLOAT32;
    field.count = 1;
    cloud_.fields.push_back(field);
    cloud_.point_step += sizeof(float);
  }

  void
  allocate()
  {
    const std::size_t bytes = std::size_t(cloud_.point_step) * cloud_.width;
    if (bytes > std::numeric_limits<std::uint32_t>::max())
      throw BadArgumentException("toPolygonMesh: " + std::to_string(cloud_.width) +
                                 " vertices are more than a PCLPointCloud2 can hold");
    cloud_.row_step = std::uint32_t(bytes);
    cloud_.data.resize(bytes);
    next_ = cloud_.data.data();
  }

  void
  put(const void* value, std::size_t size)
  {
    std::memcpy(next_, value, size);
    next_ += size;
  }

private:
  pcl::PCLPointCloud2& cloud_;
  std::uint8_t* next_ = nullptr;
};

/** Offset of a field of 32 bits [bytes], -1 = absent. */
int
offsetOf(const pcl::PCLPointCloud2& cloud, const std::string& name, bool is_float)
{
  for (const pcl::PCLPointField& field : cloud.fields)
    if (field.name == name && field.offset + 4 <= cloud.point_step &&
        (!is_float || field.datatype == pcl::PCLPointField::FLOAT32))
      return int(field.offset);
  return -1;
}

/** Three fields as one vector per vertex; false when one is absent. */
bool
readVectors(const pcl::PCLPointCloud2& cloud, const std::array<const char*, 3>& names,
            std::vector<Eigen::Vector3f>& vectors)
{
  std::array<int, 3> offsets;
  for (int i = 0; i < 3; ++i) {
    offsets[i] = offsetOf(cloud, names[i], true);
    if (offsets[i] < 0)
      return false;
  }
  vectors.resize(std::size_t(cloud.width) * cloud.height);
  for (std::size_t v = 0; v < vectors.size(); ++v)
    for (int i = 0; i < 3; ++i)
      std::memcpy(&vectors[v][i], &cloud.data[v * cloud.point_step + offsets[i]], 4);
  return true;
}

void
readScalars(const pcl::PCLPointCloud2& cloud, const char* name, std::vector<float>& scalars)
{
  const int offset = offsetOf(cloud, name, true);
  if (offset < 0)
    return;
  scalars.resize(std::size_t(cloud.width) * cloud.height);
  for (std::size_t v = 0; v < scalars.size(); ++v)
    std::memcpy(&scalars[v], &cloud.data[v * cloud.point_step + offset], 4);
}

void
readColors(const pcl::PCLPointCloud2& cloud, SurfaceMesh& mesh)
{
  int offset = offsetOf(cloud, "rgb", false);
  if (offset < 0)
    offset = offsetOf(cloud, "rgba", false);
  if (offset < 0)
    return;
  mesh.colors.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.colors.size(); ++v) {
    std::uint32_t packed;
    std::memcpy(&packed, &cloud.data[v * cloud.point_step + offset], 4);
    mesh.colors[v] = {std::uint8_t(packed >> 16), std::uint8_t(packed >> 8), std::uint8_t(packed)};
  }
}

} // namespace

pcl::PolygonMesh
toPolygonMesh(const SurfaceMesh& mesh)
{
  checkLists(mesh, "toPolygonMesh");
  pcl::PolygonMesh result;
  CloudWriter writer(result.cloud, mesh.vertices.size());
  for (const char* name : {"x", "y", "z"})
    writer.add(name);
  if (!mesh.normals.empty())
    for (const char* name : {"normal_x", "normal_y", "normal_z", "curvature"})
      writer.add(name);
  if (!mesh.colors.empty())
    writer.add("rgb");
  if (!mesh.weights.empty())
    writer.add("weight");
  if (!mesh.deviations.empty())
    writer.add("std_deviation");
  writer.allocate();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    writer.put(mesh.vertices[v].data(), 12);
    if (!mesh.normals.empty()) {
      const float curvature = 0;
      writer.put(mesh.normals[v].data(), 12);
      writer.put(&curvature, 4);
    }
    if (!mesh.colors.empty()) {
      const auto& [red, green, blue] = mesh.colors[v];
      const std::uint32_t packed =
          255u << 24 | std::uint32_t(red) << 16 | std::uint32_t(green) << 8 | std::uint32_t(blue);
      writer.put(&packed, 4);
    }
    if (!mesh.weights.empty())
      writer.put(&mesh.weights[v], 4);
    if (!mesh.deviations.empty())
      writer.put(&mesh.deviations[v], 4);
  }
  result.polygons.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    result.polygons[t].vertices.assign(mesh.triangles[t].begin(), mesh.triangles[t].end());
  return result;
}

SurfaceMesh
toSurfaceMesh(const pcl::PolygonMesh& mesh)
{
  const pcl::PCLPointCloud2& cloud = mesh.cloud;
  const std::size_t size = std::size_t(cloud.width) * cloud.height;
  if (cloud.data.size() < size * cloud.point_step)
    throw BadArgumentException("toSurfaceMesh: the cloud holds less data than its " +
                               std::to_string(size) + " vertices need");
  SurfaceMesh result;
  if (!readVectors(cloud, {"x", "y", "z"}, result.vertices))
    throw BadArgumentException("toSurfaceMesh: the vertices have no x, y, z as 32 bit floats");
  readVectors(cloud, {"normal_x", "normal_y", "normal_z"}, result.normals);
  readColors(cloud, result);
  readScalars(cloud, "weight", result.weights);
  readScalars(cloud, "std_deviation", result.deviations);
  for (const pcl::Vertices& polygon : mesh.polygons) {
    for (const auto vertex : polygon.vertices)
      if (std::size_t(vertex) >= size)
        throw BadArgumentException("toSurfaceMesh: a polygon names vertex " +
                                   std::to_string(vertex) + " of " + std::to_string(size));
    for (std::size_t i = 2; i < polygon.vertices.size(); ++i)
      result.triangles.push_back({std::uint32_t(polygon.vertices[0]),
                                  std::uint32_t(polygon.vertices[i - 1]),
                                  std::uint32_t(polygon.vertices[i])});
  }
  return result;
}

} // namespace bundle_icp
