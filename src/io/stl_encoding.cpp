// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/mesh_layout.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace bundle_icp {
namespace {

/** Little-endian, on any machine. */
void
append(std::uint32_t value, std::vector<char>& bytes)
{
  for (int shift = 0; shift < 32; shift += 8)
    bytes.push_back(char(value >> shift & 255));
}

void
append(const Eigen::Vector3f& vector, std::vector<char>& bytes)
{
  for (int i = 0; i < 3; ++i) {
    std::uint32_t bits;
    std::memcpy(&bits, &vector[i], sizeof(bits));
    append(bits, bytes);
  }
}

} // namespace

void
encodeSTL(const pcl::PolygonMesh& mesh, const VertexLayout& layout, std::ostream& file)
{
  const auto place = [&](std::size_t vertex) { return vectorAt(mesh, vertex, layout.position); };
  std::uint32_t triangles = 0;
  for (const pcl::Vertices& polygon : mesh.polygons)
    triangles += std::uint32_t(std::max<std::size_t>(polygon.vertices.size(), 2) - 2);
  // A header that begins with "solid" would announce a text file.
  std::string header = "binary STL, metres";
  header.resize(80, ' ');
  std::vector<char> bytes(header.begin(), header.end());
  append(triangles, bytes);
  for (const pcl::Vertices& polygon : mesh.polygons)
    for (std::size_t i = 2; i < polygon.vertices.size(); ++i) {
      const Eigen::Vector3f a = place(polygon.vertices[0]), b = place(polygon.vertices[i - 1]),
                            c = place(polygon.vertices[i]);
      append(Eigen::Vector3f((b - a).cross(c - a).normalized()), bytes);
      for (const Eigen::Vector3f& corner : {a, b, c})
        append(corner, bytes);
      bytes.insert(bytes.end(), 2, 0); // attributes
      flushWhenLarge(bytes, file);
    }
  flush(bytes, file);
}

} // namespace bundle_icp
