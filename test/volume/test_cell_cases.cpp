// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "voxel_field.h"

#include "volume/cell_cases.h"

#include <gtest/gtest.h>
#include <pcl/surface/marching_cubes.h>

#include <map>
#include <random>
#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Vertex = std::array<int, 4>; ///< voxel and axis of a grid edge of the world
using Triangle = std::array<Vertex, 3>;
using Inside = std::function<bool(const Eigen::Vector3i& voxel)>;

/** Voxels from -8 to 7, in 8 blocks. */
VoxelBlockMap
blocksOf(const Inside& inside)
{
  VoxelBlockMap blocks;
  fillBlocks(
      {-1, -1, -1}, {0, 0, 0},
      [&](const Eigen::Vector3i& voxel) { return inside(voxel) ? -0.5 : 0.5; }, blocks);
  return blocks;
}

BlockSurfaces
surfacesOf(const VoxelBlockMap& blocks, float level = 0)
{
  return findSurfaces(blocks, UNIT_WEIGHT, level, 1);
}

/** The triangles of all cells, by the grid edges that carry their corners. */
std::vector<Triangle>
trianglesOf(const VoxelBlockMap& blocks, const BlockSurfaces& surfaces)
{
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    for (int cell = 0; surfaces[i] && cell < BLOCK_VOXELS; ++cell) {
      const Eigen::Vector3i first = BLOCK_EDGE * blocks.coordinatesOf(i) +
                                    Eigen::Vector3i(cell & 7, cell >> 3 & 7, cell >> 6);
      for (const int* e = pcl::triTable[surfaces[i]->cases[cell]]; *e != -1; e += 3) {
        Triangle triangle;
        for (int k = 0; k < 3; ++k) {
          const GridEdge edge = cellEdge(e[k]);
          triangle[k] = {first.x() + edge.voxel[0], first.y() + edge.voxel[1],
                         first.z() + edge.voxel[2], edge.axis};
        }
        triangles.push_back(triangle);
      }
    }
  return triangles;
}

/** Volume inside, with each vertex in the middle of its edge. */
double
volumeOf(const std::vector<Triangle>& triangles)
{
  const auto place = [](const Vertex& v) -> Eigen::Vector3d {
    return Eigen::Vector3d(v[0], v[1], v[2]) + 0.5 * Eigen::Vector3d::Unit(v[3]);
  };
  double volume = 0;
  for (const Triangle& t : triangles)
    volume += place(t[0]).dot(place(t[1]).cross(place(t[2]))) / 6;
  return volume;
}

std::set<Vertex>
verticesOf(const std::vector<Triangle>& triangles)
{
  std::set<Vertex> vertices;
  for (const Triangle& triangle : triangles)
    vertices.insert(triangle.begin(), triangle.end());
  return vertices;
}

/** The grid edges between inside and outside. */
std::set<Vertex>
crossedEdges(const Inside& inside)
{
  std::set<Vertex> edges;
  for (int z = -8; z < 8; ++z)
    for (int y = -8; y < 8; ++y)
      for (int x = -8; x < 8; ++x)
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3i voxel(x, y, z);
          const Eigen::Vector3i next = voxel + Eigen::Vector3i::Unit(axis);
          if (next.maxCoeff() < 8 && inside(voxel) != inside(next))
            edges.insert({x, y, z, axis});
        }
  return edges;
}

/** Every edge runs as often one way as the other. */
void
expectClosed(const std::vector<Triangle>& triangles)
{
  std::map<std::pair<Vertex, Vertex>, int> surplus;
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) {
      ++surplus[{t[k], t[(k + 1) % 3]}];
      --surplus[{t[(k + 1) % 3], t[k]}];
    }
  for (const auto& [edge, count] : surplus)
    ASSERT_EQ(count, 0);
}

/** The corners of the cell at `first` that the bits of `pattern` name. */
Inside
corners(const Eigen::Vector3i& first, int pattern)
{
  std::set<std::array<int, 3>> voxels;
  for (int corner = 0; corner < 8; ++corner)
    if (pattern >> corner & 1) {
      const auto offset = cellCorner(corner);
      voxels.insert({first.x() + offset[0], first.y() + offset[1], first.z() + offset[2]});
    }
  return [voxels](const Eigen::Vector3i& v) { return voxels.count({v.x(), v.y(), v.z()}) > 0; };
}

/** Half of all voxels, none at the border of the observed space. */
Inside
scattered(unsigned seed)
{
  std::mt19937 random(seed);
  std::vector<bool> bits(16 * 16 * 16);
  for (std::size_t i = 0; i < bits.size(); ++i)
    bits[i] = random() & 1;
  return [bits](const Eigen::Vector3i& v) {
    return v.minCoeff() > -8 && v.maxCoeff() < 7 &&
           bits[std::size_t((v.z() + 8) * 256 + (v.y() + 8) * 16 + v.x() + 8)];
  };
}

} // namespace

TEST(CellCases, EdgesJoinTheCornersThatTheTableOfEdgesNames)
{
  std::set<std::array<int, 3>> places;
  for (int corner = 0; corner < 8; ++corner)
    places.insert(cellCorner(corner));
  EXPECT_EQ(places.size(), 8u);
  for (int pattern = 0; pattern < 256; ++pattern) {
    const Inside inside = corners({0, 0, 0}, pattern);
    for (int i = 0; i < 12; ++i) {
      const GridEdge edge = cellEdge(i);
      const Eigen::Vector3i voxel(edge.voxel[0], edge.voxel[1], edge.voxel[2]);
      ASSERT_EQ(inside(voxel) != inside(voxel + Eigen::Vector3i::Unit(edge.axis)),
                bool(pcl::edgeTable[pattern] >> i & 1))
          << "case " << pattern << ", edge " << i;
    }
  }
}

TEST(CellCases, OneVoxelIsAnOctahedron)
{
  // In the middle of a block, at its border and where eight blocks meet
  for (const Eigen::Vector3i& voxel :
       {Eigen::Vector3i(3, 3, 3), Eigen::Vector3i(0, 4, -1), Eigen::Vector3i(-1, 0, 0)}) {
    const VoxelBlockMap blocks = blocksOf([&](const Eigen::Vector3i& v) { return v == voxel; });
    const auto triangles = trianglesOf(blocks, surfacesOf(blocks));
    EXPECT_EQ(triangles.size(), 8u);
    EXPECT_EQ(verticesOf(triangles).size(), 6u);
    expectClosed(triangles);
    EXPECT_NEAR(volumeOf(triangles), 4.0 / 3 * std::pow(0.5, 3), 1e-12);
  }
}

TEST(CellCases, All256CasesAreClosedAndFaceOutward)
{
  for (const Eigen::Vector3i& first : {Eigen::Vector3i(2, 3, 4), Eigen::Vector3i(-1, -1, -1)})
    for (int pattern = 1; pattern < 256; ++pattern) {
      SCOPED_TRACE("case " + std::to_string(pattern));
      const Inside inside = corners(first, pattern);
      const VoxelBlockMap blocks = blocksOf(inside);
      const BlockSurfaces surfaces = surfacesOf(blocks);
      const auto home = blocks.indexOf({first.x() >> 3, first.y() >> 3, first.z() >> 3});
      EXPECT_EQ(surfaces[home]->cases[placeOf(first)], pattern == 255 ? 0 : pattern);
      const auto triangles = trianglesOf(blocks, surfaces);
      expectClosed(triangles);
      // Two voxels hold less than their cubes, and none less than an octahedron.
      const double voxels = __builtin_popcount(pattern), volume = volumeOf(triangles);
      EXPECT_GE(volume, voxels / 6 - 1e-9);
      EXPECT_LE(volume, voxels);
      // Closed surfaces without handles: 2 for each, V - E + F with E = 3/2 F.
      const auto euler = int(verticesOf(triangles).size()) - int(triangles.size()) / 2;
      EXPECT_GT(euler, 0);
      EXPECT_EQ(euler % 2, 0);
    }
}

TEST(CellCases, ScatteredVoxelsAreClosedAcrossBlocks)
{
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Inside inside = scattered(seed);
    const VoxelBlockMap blocks = blocksOf(inside);
    const auto triangles = trianglesOf(blocks, surfacesOf(blocks));
    EXPECT_GT(triangles.size(), 5000u);
    expectClosed(triangles);
    EXPECT_EQ(verticesOf(triangles), crossedEdges(inside));
    EXPECT_EQ(trianglesOf(blocks, findSurfaces(blocks, UNIT_WEIGHT, 0, 3)), triangles);
  }
}

TEST(CellCases, VerticesAreNumberedWithoutGaps)
{
  const Inside inside = scattered(7);
  const VoxelBlockMap blocks = blocksOf(inside);
  const BlockSurfaces surfaces = surfacesOf(blocks);
  std::set<std::uint32_t> numbers;
  const std::set<Vertex> vertices = crossedEdges(inside);
  for (const Vertex& v : vertices) {
    const BlockSurface& surface = *surfaces[blocks.indexOf({v[0] >> 3, v[1] >> 3, v[2] >> 3})];
    const GridEdge edge{{v[0] & 7, v[1] & 7, v[2] & 7}, v[3]};
    ASSERT_TRUE(surface.hasEdge(edge));
    const std::uint32_t number = surface.vertexOf(edge);
    ASSERT_GE(number, surface.first_vertex);
    ASSERT_LT(number, surface.first_vertex + surface.num_vertices);
    numbers.insert(number);
  }
  EXPECT_EQ(numbers.size(), vertices.size());
  EXPECT_EQ(*numbers.rbegin(), vertices.size() - 1);
  std::uint32_t triangles = 0;
  for (const auto& surface : surfaces) {
    EXPECT_EQ(surface->first_triangle, triangles);
    triangles += surface->num_triangles;
  }
  EXPECT_EQ(triangles, trianglesOf(blocks, surfaces).size());
}

TEST(CellCases, AVoxelOfLittleWeightLeavesItsEightCellsOpen)
{
  VoxelBlockMap blocks = blocksOf([](const Eigen::Vector3i& v) { return v.z() < 0; });
  const auto before = trianglesOf(blocks, surfacesOf(blocks));
  EXPECT_EQ(before.size(), 15u * 15u * 2u);
  const Eigen::Vector3i poor(0, 3, -1);
  --blockOf(poor, blocks).weight[placeOf(poor)];
  const auto after = trianglesOf(blocks, surfacesOf(blocks));
  EXPECT_EQ(after.size(), before.size() - 4 * 2); // four of the eight are at the surface
  EXPECT_EQ(trianglesOf(blocks, findSurfaces(blocks, UNIT_WEIGHT - 1, 0, 1)), before);
}

TEST(CellCases, BesideUnobservedVoxelsEveryTriangleHasItsVertices)
{
  // Then an edge may be used by cells of other blocks alone.
  const Inside inside = scattered(5);
  VoxelBlockMap blocks = blocksOf(inside);
  std::mt19937 random(6);
  for (std::size_t i = 0; i < blocks.size(); ++i)
    for (std::uint16_t& weight : blocks[i].weight)
      weight = random() % 5 ? weight : 0;
  const BlockSurfaces surfaces = surfacesOf(blocks);
  const std::set<Vertex> vertices = verticesOf(trianglesOf(blocks, surfaces));
  EXPECT_GT(vertices.size(), 1000u);
  std::set<std::uint32_t> numbers;
  for (const Vertex& v : vertices) {
    const auto& surface = surfaces[blocks.indexOf({v[0] >> 3, v[1] >> 3, v[2] >> 3})];
    const GridEdge edge{{v[0] & 7, v[1] & 7, v[2] & 7}, v[3]};
    ASSERT_TRUE(surface && surface->hasEdge(edge));
    numbers.insert(surface->vertexOf(edge));
  }
  EXPECT_EQ(numbers.size(), vertices.size());
  std::size_t total = 0;
  for (const auto& surface : surfaces)
    total += surface ? surface->num_vertices : 0;
  EXPECT_EQ(total, vertices.size()); // and no vertex is without triangle
}

TEST(CellCases, TheLevelMovesTheSurfaceAlongTheField)
{
  VoxelBlockMap blocks;
  fillBlocks(
      {-1, -1, -1}, {0, 0, 0}, [](const Eigen::Vector3i& v) { return (v.x() + 0.5) / 10; }, blocks);
  for (const int layer : {-1, 0, 3, 5}) {
    const float level = float(layer + 1) / 10 * DISTANCE_SCALE;
    const auto triangles = trianglesOf(blocks, surfacesOf(blocks, level));
    EXPECT_EQ(triangles.size(), 15u * 15u * 2u);
    for (const Vertex& vertex : verticesOf(triangles))
      ASSERT_EQ(vertex[0], layer);
  }
}

TEST(CellCases, BlocksWithoutAnythingBehindASurfaceHaveNone)
{
  const VoxelBlockMap outside = blocksOf([](const auto&) { return false; });
  for (const auto& surface : surfacesOf(outside))
    EXPECT_EQ(surface, nullptr);
  const VoxelBlockMap inside = blocksOf([](const auto&) { return true; });
  EXPECT_TRUE(trianglesOf(inside, surfacesOf(inside)).empty());
  EXPECT_TRUE(surfacesOf(VoxelBlockMap()).empty());
}

TEST(CellCases, NeighborsAreThoseBetweenTheOffsets)
{
  const VoxelBlockMap blocks = blocksOf([](const auto&) { return false; });
  const auto number = std::size_t(blocks.indexOf({0, -1, -1}));
  const BlockNeighbors all = neighborsOf(blocks, number, -1, 1),
                       ahead = neighborsOf(blocks, number, 0, 1);
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const std::int64_t expected = blocks.indexOf({dx, dy - 1, dz - 1});
        const int i = neighborIndex(dx, dy, dz);
        EXPECT_EQ(all[i], expected);
        EXPECT_EQ(ahead[i], std::min({dx, dy, dz}) < 0 ? -1 : expected);
      }
}
