// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <pcl/PolygonMesh.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <ostream>
#include <string>
#include <vector>

namespace bundle_icp {

/** Byte offsets of a vertex's fields; -1 = absent. */
struct VertexLayout {
  int position[3] = {-1, -1, -1}, normal[3] = {-1, -1, -1};
  int color = -1; ///< of 0xaarrggbb

  bool
  hasNormals() const
  {
    return normal[0] >= 0 && normal[1] >= 0 && normal[2] >= 0;
  }

  bool
  hasColors() const
  {
    return color >= 0;
  }
};

inline std::size_t
numVertices(const pcl::PolygonMesh& mesh)
{
  return std::size_t(mesh.cloud.width) * mesh.cloud.height;
}

/** Position or normal of a vertex. */
inline Eigen::Vector3f
vectorAt(const pcl::PolygonMesh& mesh, std::size_t vertex, const int (&offsets)[3])
{
  Eigen::Vector3f vector;
  for (int i = 0; i < 3; ++i)
    std::memcpy(&vector[i], &mesh.cloud.data[vertex * mesh.cloud.point_step + offsets[i]],
                sizeof(float));
  return vector;
}

inline bool
isLittleEndian()
{
  const std::uint16_t one = 1;
  return *reinterpret_cast<const std::uint8_t*>(&one) == 1;
}

/** Writes the bytes collected so far and forgets them. */
template <typename Bytes>
void
flush(Bytes& bytes, std::ostream& file)
{
  file.write(bytes.data(), std::streamsize(bytes.size()));
  bytes.clear();
}

/** Red, green and blue of a vertex, each in 0 ... 1. */
inline Eigen::Vector3f
colorAt(const pcl::PolygonMesh& mesh, std::size_t vertex, int offset)
{
  std::uint32_t rgb = 0;
  std::memcpy(&rgb, &mesh.cloud.data[vertex * mesh.cloud.point_step + std::size_t(offset)],
              sizeof(rgb));
  return Eigen::Vector3f(float(rgb >> 16 & 255), float(rgb >> 8 & 255), float(rgb & 255)) / 255.0f;
}

/** Writes the bytes when there are enough of them: files of large meshes are not held in memory. */
template <typename Bytes>
void
flushWhenLarge(Bytes& bytes, std::ostream& file)
{
  if (bytes.size() >= std::size_t(1) << 20)
    flush(bytes, file);
}

/** Binary PLY; the element of faces is left out when there are none. */
void
encodePLY(const pcl::PolygonMesh& mesh, std::ostream& file);

/** Mesh of a PLY file, see readMesh(). \throws std::runtime_error with the reason when `bytes` are
 *  no such file. */
pcl::PolygonMesh
decodePLY(const std::string& bytes);

/** OBJ: positions, normals, faces. */
void
encodeOBJ(const pcl::PolygonMesh& mesh, const VertexLayout& layout, std::ostream& file);

/** Binary STL: an 80 byte header, then 50 bytes a triangle; polygons are cut into triangles around
 *  their first corner. */
void
encodeSTL(const pcl::PolygonMesh& mesh, const VertexLayout& layout, std::ostream& file);

} // namespace bundle_icp
