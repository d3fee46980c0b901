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

/** Writes a mesh, or a cloud as a mesh without faces. The extension of `path` gives the format:
 *  - .ply, binary: fields of the mesh's cloud under their own names, without curvature; normals as
 *    nx, ny, nz; colours as uchar red, green, blue; faces as lists of int
 *  - .obj, text: positions, each with its colour (`v x y z r g b`, colours in 0 ... 1, as MeshLab
 *    writes them), normals, faces
 *  - .stl, binary: triangles with their normals; polygons are cut into triangles
 *
 *  The file appears whole or not at all.
 *  \throws pcl::BadArgumentException for another extension, a cloud without x, y, z as 32 bit
 *  floats or of inconsistent size, a face with more than 255 corners or a vertex that does not
 *  exist; in OBJ also for no vertices or a face without corners.
 *  \throws pcl::IOException naming `path` and the reason. */
BUNDLE_ICP_EXPORT void
writeMesh(const std::string& path, const pcl::PolygonMesh& mesh);

/** Reads a PLY file, binary or text, from this library, PCL or other programs. Each number of a
 *  vertex becomes a field of 32 bit floats; nx, ny, nz become normal_x, normal_y, normal_z; red,
 *  green, blue become rgb.
 *  \throws pcl::IOException naming `path` and what is wrong with the file. */
BUNDLE_ICP_EXPORT pcl::PolygonMesh
readMesh(const std::string& path);

} // namespace bundle_icp
