// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <pcl/PolygonMesh.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** Extensions of the formats that writeMesh() knows: ply, obj, stl. */
BUNDLE_ICP_EXPORT std::vector<std::string>
meshFormats();

/** Writes a mesh in the format that the extension of `path` says:
 *  - .ply, binary: float x, y, z, and as far as the mesh's cloud has the fields, float nx, ny, nz,
 *    uchar red, green, blue, float weight, float std_deviation [m]; faces as lists of int
 *  - .obj, text, by pcl::io::saveOBJFile(): places and normals, faces
 *  - .stl, binary: triangles with their normals, polygons cut into triangles
 *
 *  The file appears whole or not at all.
 *  \throws pcl::BadArgumentException for another extension, when the cloud has no x, y, z as 32 bit
 *  floats, its size is inconsistent, or a face has more than 255 corners or names a vertex that
 *  does not exist; in OBJ, when there is no vertex, or a face without corners.
 *  \throws pcl::IOException naming `path` and the reason. */
BUNDLE_ICP_EXPORT void
writeMesh(const std::string& path, const pcl::PolygonMesh& mesh);

} // namespace bundle_icp
