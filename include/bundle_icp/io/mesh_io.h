// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <pcl/PolygonMesh.h>

#include <string>

namespace bundle_icp {

/** Writes a mesh as binary PLY: float x, y, z, then float nx, ny, nz and uchar red,
 *  green, blue when the mesh's cloud has the fields normal_x... and rgb or rgba; faces
 *  as lists of int. The file appears whole or not at all.
 *  \throws pcl::BadArgumentException when the cloud has no x, y, z as 32 bit floats,
 * its size is inconsistent, or a face has more than 255 corners or names a vertex that
 * does not exist. \throws pcl::IOException naming `path` and the reason. */
BUNDLE_ICP_EXPORT void
writeMesh(const std::string& path, const pcl::PolygonMesh& mesh);

} // namespace bundle_icp
