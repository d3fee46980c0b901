// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <pcl/PolygonMesh.h>

#include <cstddef>
#include <ostream>
#include <vector>

namespace bundle_icp {

/** Where a vertex has what, in bytes; -1 = absent. */
struct VertexLayout {
  int position[3] = {-1, -1, -1}, normal[3] = {-1, -1, -1}, rgb = -1, weight = -1,
      std_deviation = -1;

  bool
  hasNormals() const
  {
    return normal[0] >= 0 && normal[1] >= 0 && normal[2] >= 0;
  }
};

inline std::size_t
numVertices(const pcl::PolygonMesh& mesh)
{
  return std::size_t(mesh.cloud.width) * mesh.cloud.height;
}

/** Writes the bytes collected so far and forgets them. */
inline void
flush(std::vector<char>& bytes, std::ostream& file)
{
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.clear();
}

/** The same once they are worth it: files of large meshes are not held in memory. */
inline void
flushWhenLarge(std::vector<char>& bytes, std::ostream& file)
{
  if (bytes.size() >= std::size_t(1) << 20)
    flush(bytes, file);
}

/** Binary STL: an 80 byte header, then 50 bytes a triangle; polygons are cut into triangles around
 *  their first corner. */
void
encodeSTL(const pcl::PolygonMesh& mesh, const VertexLayout& layout, std::ostream& file);

} // namespace bundle_icp
