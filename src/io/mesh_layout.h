// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <pcl/PolygonMesh.h>

#include <cstddef>
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

/** Content of a binary STL file: an 80 byte header, then 50 bytes a triangle; polygons are cut into
 *  triangles around their first corner. */
std::vector<char>
encodeSTL(const pcl::PolygonMesh& mesh, const VertexLayout& layout);

} // namespace bundle_icp
