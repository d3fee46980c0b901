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

/** Writes a mesh, or a cloud as a mesh without faces, in the format that the extension of `path`
 *  says:
 *  - .ply, binary: the fields of the mesh's cloud under their names but for curvature, normals as
 *    nx, ny, nz, colours as uchar red, green, blue; faces as lists of int
 *  - .obj, text: places and normals, faces
 *  - .stl, binary: triangles with their normals, polygons cut into triangles
 *
 *  The file appears whole or not at all.
 *  \throws pcl::BadArgumentException for another extension, when the cloud has no x, y, z as 32 bit
 *  floats, its size is inconsistent, or a face has more than 255 corners or names a vertex that
 *  does not exist; in OBJ, when there is no vertex, or a face without corners.
 *  \throws pcl::IOException naming `path` and the reason. */
BUNDLE_ICP_EXPORT void
writeMesh(const std::string& path, const pcl::PolygonMesh& mesh);

/** Reads a PLY file, binary or text, of this library, PCL or others: every number of a vertex as a
 *  field of 32 bit floats, nx, ny, nz as normal_x, normal_y, normal_z, red, green, blue as rgb.
 *  \throws pcl::IOException naming `path` and what is wrong with it. */
BUNDLE_ICP_EXPORT pcl::PolygonMesh
readMesh(const std::string& path);

} // namespace bundle_icp
