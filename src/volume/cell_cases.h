// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "volume/voxel_blocks.h"

#include <array>
#include <memory>
#include <vector>

namespace bundle_icp {

/** An edge of the voxel grid: it leaves `voxel` along `axis`. */
struct GridEdge {
  int voxel[3];
  int axis;
};

/** The corner of a cell in the order of pcl::edgeTable. */
constexpr std::array<int, 3>
cellCorner(int corner)
{
  return {(corner & 1) ^ (corner >> 1 & 1), corner >> 2 & 1, corner >> 1 & 1};
}

/** The edges of a cell in the order of pcl::edgeTable, relative to the cell. */
constexpr GridEdge
cellEdge(int edge)
{
  const int from = edge < 8 ? edge : edge - 8;
  const int to = edge < 4 ? (edge + 1) % 4 : edge < 8 ? (edge + 1) % 4 + 4 : edge - 4;
  const auto a = cellCorner(from), b = cellCorner(to);
  const int axis = a[0] != b[0] ? 0 : a[1] != b[1] ? 1 : 2;
  return {{a[0] < b[0] ? a[0] : b[0], a[1] < b[1] ? a[1] : b[1], a[2] < b[2] ? a[2] : b[2]}, axis};
}

constexpr int
voxelIndex(int x, int y, int z)
{
  return z * BLOCK_SLAB + y * BLOCK_EDGE + x;
}

/** The surface in one block: the marching cubes case of each cell (a cell belongs to the block of
 *  its first corner; 0 = no surface, or not observed), and the grid edges that carry a vertex. */
class BlockSurface {
public:
  std::uint8_t cases[BLOCK_VOXELS] = {};
  std::uint32_t first_vertex = 0;
  std::uint32_t first_triangle = 0;
  std::uint32_t num_vertices = 0;
  std::uint32_t num_triangles = 0;

  void
  markEdge(const GridEdge& edge)
  {
    edges_[edge.axis][edge.voxel[2]] |= std::uint64_t(1) << bit(edge);
  }

  bool
  hasEdge(const GridEdge& edge) const
  {
    return edges_[edge.axis][edge.voxel[2]] >> bit(edge) & 1;
  }

  /** Fixes the numbers of the vertices; vertexOf() may be called afterwards. */
  void
  countVertices();

  /** Number in the mesh of the vertex on a marked edge. */
  std::uint32_t
  vertexOf(const GridEdge& edge) const
  {
    const std::uint64_t before =
        edges_[edge.axis][edge.voxel[2]] & ((std::uint64_t(1) << bit(edge)) - 1);
    return first_vertex + counts_[edge.axis][edge.voxel[2]] +
           std::uint32_t(__builtin_popcountll(before));
  }

private:
  static int
  bit(const GridEdge& edge)
  {
    return edge.voxel[1] * BLOCK_EDGE + edge.voxel[0];
  }

  std::uint64_t edges_[3][BLOCK_EDGE] = {}; // one bit per voxel of a slab
  std::uint16_t counts_[3][BLOCK_EDGE] = {};
};

/** Numbers of a block's neighbours, -1 = none; offsets from -1 to 1, x fastest. */
using BlockNeighbors = std::array<std::int64_t, 27>;

/** Neighbours with all offsets between `first` and `last`; other neighbours count as absent. */
BlockNeighbors
neighborsOf(const VoxelBlockMap& blocks, std::size_t index, int first, int last);

constexpr int
neighborIndex(int dx, int dy, int dz)
{
  return (dz + 1) * 9 + (dy + 1) * 3 + dx + 1;
}

/** By number of block; null where there is no surface. */
using BlockSurfaces = std::vector<std::unique_ptr<BlockSurface>>;

/** Finds the cases and edges of all blocks. Voxels with a smaller weight code count as
 *  not observed; `level` is the stored distance that separates inside from outside. */
BlockSurfaces
findSurfaces(const VoxelBlockMap& blocks, int min_weight_code, float level, int num_threads);

} // namespace bundle_icp
