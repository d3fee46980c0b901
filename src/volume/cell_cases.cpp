// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/cell_cases.h"

#include <pcl/surface/marching_cubes.h>

#include <algorithm>

namespace bundle_icp {
namespace {

// Cells reach one voxel into the next blocks.
constexpr int PADDED_EDGE = BLOCK_EDGE + 1;

constexpr int
paddedIndex(int x, int y, int z)
{
  return (z * PADDED_EDGE + y) * PADDED_EDGE + x;
}

enum VoxelState : std::uint8_t { UNKNOWN = 0, OUTSIDE = 1, INSIDE = 2 };

// States of the voxels [0, 8] along each axis.
void
readStates(const VoxelBlockMap& blocks, const BlockNeighbors& neighbors, int min_weight_code,
           float level, std::uint8_t* states)
{
  for (int z = 0; z <= BLOCK_EDGE; ++z)
    for (int y = 0; y <= BLOCK_EDGE; ++y)
      for (int x = 0; x <= BLOCK_EDGE; ++x) {
        const std::int64_t number = neighbors[neighborIndex(x >> 3, y >> 3, z >> 3)];
        std::uint8_t state = UNKNOWN;
        if (number >= 0) {
          const VoxelBlock& block = blocks[number];
          const int voxel = voxelIndex(x & 7, y & 7, z & 7);
          if (block.weight[voxel] >= min_weight_code)
            state = float(block.distance[voxel]) < level ? INSIDE : OUTSIDE;
        }
        states[paddedIndex(x, y, z)] = state;
      }
}

std::uint8_t
cellCase(const std::uint8_t* states, int x, int y, int z)
{
  int inside = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto offset = cellCorner(corner);
    const std::uint8_t state = states[paddedIndex(x + offset[0], y + offset[1], z + offset[2])];
    if (state == UNKNOWN)
      return 0;
    inside |= (state == INSIDE ? 1 : 0) << corner;
  }
  return std::uint8_t(inside == 255 ? 0 : inside);
}

std::uint32_t
numTriangles(std::uint8_t cell_case)
{
  std::uint32_t count = 0;
  while (pcl::triTable[cell_case][3 * count] != -1)
    ++count;
  return count;
}

std::unique_ptr<BlockSurface>
findCases(const VoxelBlockMap& blocks, std::size_t index, int min_weight_code, float level)
{
  const BlockNeighbors neighbors = neighborsOf(blocks, index, 0, 1);
  std::unique_ptr<BlockSurface> surface;
  const bool any_inside =
      level > 0 || std::any_of(neighbors.begin(), neighbors.end(),
                               [&](std::int64_t i) { return i >= 0 && blocks.mayHoldSurface(i); });
  if (!any_inside)
    return surface;
  std::uint8_t states[PADDED_EDGE * PADDED_EDGE * PADDED_EDGE];
  readStates(blocks, neighbors, min_weight_code, level, states);
  for (int z = 0; z < BLOCK_EDGE; ++z)
    for (int y = 0; y < BLOCK_EDGE; ++y)
      for (int x = 0; x < BLOCK_EDGE; ++x) {
        const std::uint8_t found = cellCase(states, x, y, z);
        if (found == 0)
          continue;
        if (!surface)
          surface = std::make_unique<BlockSurface>();
        surface->cases[voxelIndex(x, y, z)] = found;
        surface->num_triangles += numTriangles(found);
      }
  return surface;
}

// Marks those edges of a neighbour's cells that belong to this block.
void
markEdgesOf(const BlockSurface& neighbor, const int shift[3], BlockSurface& surface)
{
  for (int z = shift[2] < 0 ? 7 : 0; z < BLOCK_EDGE; ++z)
    for (int y = shift[1] < 0 ? 7 : 0; y < BLOCK_EDGE; ++y)
      for (int x = shift[0] < 0 ? 7 : 0; x < BLOCK_EDGE; ++x) {
        const std::uint8_t cell_case = neighbor.cases[voxelIndex(x, y, z)];
        if (cell_case == 0)
          continue;
        for (int i = 0; i < 12; ++i) {
          GridEdge edge = cellEdge(i);
          edge.voxel[0] += x + shift[0] * BLOCK_EDGE;
          edge.voxel[1] += y + shift[1] * BLOCK_EDGE;
          edge.voxel[2] += z + shift[2] * BLOCK_EDGE;
          const bool own = ((edge.voxel[0] | edge.voxel[1] | edge.voxel[2]) & ~7) == 0;
          if (own && pcl::edgeTable[cell_case] >> i & 1)
            surface.markEdge(edge);
        }
      }
}

// An edge may be used only by cells of the blocks before this one.
std::unique_ptr<BlockSurface>
findEdges(const VoxelBlockMap& blocks, const BlockSurfaces& cases, std::size_t index)
{
  const BlockNeighbors neighbors = neighborsOf(blocks, index, -1, 0);
  std::unique_ptr<BlockSurface> surface;
  for (int i = 0; i < 8; ++i) {
    const int shift[3] = {-(i & 1), -(i >> 1 & 1), -(i >> 2)};
    const std::int64_t number = neighbors[neighborIndex(shift[0], shift[1], shift[2])];
    if (number < 0 || !cases[number])
      continue;
    if (!surface)
      surface = std::make_unique<BlockSurface>();
    markEdgesOf(*cases[number], shift, *surface);
  }
  if (surface)
    surface->countVertices();
  return surface;
}

} // namespace

void
BlockSurface::countVertices()
{
  num_vertices = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int z = 0; z < BLOCK_EDGE; ++z) {
      counts_[axis][z] = std::uint16_t(num_vertices);
      num_vertices += std::uint32_t(__builtin_popcountll(edges_[axis][z]));
    }
}

BlockNeighbors
neighborsOf(const VoxelBlockMap& blocks, std::size_t index, int first, int last)
{
  const Eigen::Vector3i block = blocks.coordinatesOf(index);
  BlockNeighbors neighbors;
  neighbors.fill(-1);
  for (int dz = first; dz <= last; ++dz)
    for (int dy = first; dy <= last; ++dy)
      for (int dx = first; dx <= last; ++dx)
        neighbors[neighborIndex(dx, dy, dz)] = blocks.indexOf(block + Eigen::Vector3i(dx, dy, dz));
  return neighbors;
}

BlockSurfaces
findSurfaces(const VoxelBlockMap& blocks, int min_weight_code, float level, int num_threads)
{
  const auto size = std::int64_t(blocks.size());
  BlockSurfaces surfaces(blocks.size()), edges(blocks.size());
#pragma omp parallel for schedule(dynamic, 64) num_threads(num_threads)
  for (std::int64_t i = 0; i < size; ++i)
    surfaces[i] = findCases(blocks, i, min_weight_code, level);
#pragma omp parallel for schedule(dynamic, 64) num_threads(num_threads)
  for (std::int64_t i = 0; i < size; ++i)
    edges[i] = findEdges(blocks, surfaces, i);

  std::uint32_t num_vertices = 0, num_triangles = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!edges[i])
      continue;
    if (surfaces[i]) {
      std::copy_n(surfaces[i]->cases, BLOCK_VOXELS, edges[i]->cases);
      edges[i]->num_triangles = surfaces[i]->num_triangles;
    }
    edges[i]->first_vertex = num_vertices;
    edges[i]->first_triangle = num_triangles;
    num_vertices += edges[i]->num_vertices;
    num_triangles += edges[i]->num_triangles;
  }
  return edges;
}

} // namespace bundle_icp
