// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/mesh_layout.h"

#include <charconv>

namespace bundle_icp {
namespace {

/** The shortest text that reads back as the same number, in any locale. */
void
append(const Eigen::Vector3f& vector, std::string& text)
{
  for (int i = 0; i < 3; ++i) {
    char number[32];
    text += ' ';
    text.append(number, std::to_chars(number, number + sizeof(number), vector[i]).ptr);
  }
}

} // namespace

void
encodeOBJ(const pcl::PolygonMesh& mesh, const VertexLayout& layout, std::ostream& file)
{
  std::string text = "# metres\n";
  for (std::size_t i = 0; i < numVertices(mesh); ++i) {
    text += 'v';
    append(vectorAt(mesh, i, layout.position), text);
    if (layout.hasColors()) // no standard, but MeshLab, Blender, Open3D and trimesh read it
      append(colorAt(mesh, i, layout.color), text);
    text += '\n';
    flushWhenLarge(text, file);
  }
  for (std::size_t i = 0; i < numVertices(mesh) && layout.hasNormals(); ++i) {
    text += "vn";
    append(vectorAt(mesh, i, layout.normal), text);
    text += '\n';
    flushWhenLarge(text, file);
  }
  for (const pcl::Vertices& polygon : mesh.polygons) {
    text += 'f';
    for (const auto vertex : polygon.vertices) {
      const std::string number = std::to_string(vertex + 1);
      text += ' ' + number + (layout.hasNormals() ? "//" + number : "");
    }
    text += '\n';
    flushWhenLarge(text, file);
  }
  flush(text, file);
}

} // namespace bundle_icp
