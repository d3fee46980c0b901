// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/mesh/surface_mesh.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

// Meshes of known shape, and what holds for any sound mesh.
namespace bundle_icp::test {

using DirectedEdges = std::map<std::pair<std::uint32_t, std::uint32_t>, int>;

inline DirectedEdges
directedEdges(const SurfaceMesh& mesh)
{
  DirectedEdges edges;
  for (const auto& triangle : mesh.triangles)
    for (int i = 0; i < 3; ++i)
      ++edges[{triangle[i], triangle[(i + 1) % 3]}];
  return edges;
}

inline std::size_t
numOpenEdges(const SurfaceMesh& mesh)
{
  const DirectedEdges edges = directedEdges(mesh);
  return std::count_if(edges.begin(), edges.end(), [&](const auto& edge) {
    return !edges.count({edge.first.second, edge.first.first});
  });
}

inline double
enclosedVolume(const SurfaceMesh& mesh)
{
  double volume = 0;
  for (const auto& t : mesh.triangles)
    volume += mesh.vertices[t[0]].cast<double>().dot(
                  mesh.vertices[t[1]].cast<double>().cross(mesh.vertices[t[2]].cast<double>())) /
              6;
  return volume;
}

/** No duplicate, no triangle without area, each edge once in each direction, no list of another
 *  size, no vertex without triangle. */
inline void
expectSound(const SurfaceMesh& mesh)
{
  std::set<std::array<float, 3>> places;
  for (const Eigen::Vector3f& v : mesh.vertices)
    EXPECT_TRUE(places.insert({v.x(), v.y(), v.z()}).second) << v.transpose();
  std::vector<bool> used(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(),
                          b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    const double longest =
        std::max({(a - b).squaredNorm(), (b - c).squaredNorm(), (c - a).squaredNorm()});
    EXPECT_GT((b - a).cross(c - a).norm(), 1e-6 * longest);
    for (const std::uint32_t vertex : t)
      used.at(vertex) = true;
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
  for (const auto& [edge, count] : directedEdges(mesh))
    EXPECT_EQ(count, 1) << edge.first << " " << edge.second;
  EXPECT_EQ(mesh.normals.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.weights.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.deviations.size(), mesh.vertices.size());
}

inline void
fillLists(SurfaceMesh& mesh, const std::function<Eigen::Vector3f(const Eigen::Vector3f&)>& normal)
{
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    mesh.normals.push_back(normal(vertex));
    mesh.colors.push_back({10, 100, 200});
    mesh.weights.push_back(2);
    mesh.deviations.push_back(0.001f);
  }
}

/** A cell of a grid keeps its two triangles where `has` says so. */
inline void
addGrid(SurfaceMesh& mesh, int columns, int rows, const std::function<bool(int, int)>& has)
{
  const auto base = std::uint32_t(mesh.vertices.size()) - std::uint32_t((columns + 1) * (rows + 1));
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const std::uint32_t a = base + y * (columns + 1) + x, b = a + 1, c = a + columns + 1,
                          d = c + 1;
      if (!has(x, y))
        continue;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
}

/** A square of edge 1 m in the plane z = 0, facing +z. */
inline SurfaceMesh
squareMesh(
    int cells, const std::function<bool(int, int)>& has = [](int, int) { return true; })
{
  SurfaceMesh mesh;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x)
      mesh.vertices.emplace_back(float(x) / float(cells), float(y) / float(cells), 0.0f);
  addGrid(mesh, cells, cells, has);
  fillLists(mesh, [](const auto&) { return Eigen::Vector3f(0, 0, 1); });
  return mesh;
}

/** A sphere about the origin: the faces of a cube, each `cells` wide, blown up. */
inline SurfaceMesh
sphereMesh(double radius, int cells)
{
  SurfaceMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto vertexOf = [&](int axis, int sign, int u, int v) {
    std::array<int, 3> place;
    place[axis] = sign * cells;
    place[(axis + 1) % 3] = 2 * u - cells;
    place[(axis + 2) % 3] = 2 * v - cells;
    const auto [found, is_new] = numbers.insert({place, std::uint32_t(numbers.size())});
    if (is_new)
      mesh.vertices.push_back(
          (Eigen::Vector3d(place[0], place[1], place[2]).normalized() * radius).cast<float>());
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {-1, 1})
      for (int u = 0; u < cells; ++u)
        for (int v = 0; v < cells; ++v) {
          std::uint32_t a = vertexOf(axis, sign, u, v), b = vertexOf(axis, sign, u + 1, v),
                        c = vertexOf(axis, sign, u + 1, v + 1), d = vertexOf(axis, sign, u, v + 1);
          if (sign < 0)
            std::swap(b, d);
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({a, c, d});
        }
  fillLists(mesh, [](const Eigen::Vector3f& vertex) { return vertex.normalized(); });
  return mesh;
}

/** Removes the triangles whose middle `is_cut` says so of; their vertices stay. */
inline void
cut(SurfaceMesh& mesh, const std::function<bool(const Eigen::Vector3f&)>& is_cut)
{
  mesh.triangles.erase(
      std::remove_if(mesh.triangles.begin(), mesh.triangles.end(),
                     [&](const auto& t) {
                       return is_cut(
                           (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3);
                     }),
      mesh.triangles.end());
}

/** Every list, bit by bit. */
inline void
expectSame(const SurfaceMesh& one, const SurfaceMesh& other)
{
  EXPECT_EQ(one.vertices, other.vertices);
  EXPECT_EQ(one.normals, other.normals);
  EXPECT_EQ(one.colors, other.colors);
  EXPECT_EQ(one.weights, other.weights);
  EXPECT_EQ(one.deviations, other.deviations);
  EXPECT_EQ(one.triangles, other.triangles);
}

} // namespace bundle_icp::test
