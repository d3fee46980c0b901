// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/cell_cases.h"
#include "surface/num_threads.h"
#include "surface/tsdf_volume_impl.h"

#include <bundle_icp/surface/extract_surface.h>

#include <pcl/exceptions.h>
#include <pcl/surface/marching_cubes.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bundle_icp {
namespace {

/** The voxels of a block and of its neighbours. */
class VoxelAccess {
public:
  struct Voxel {
    float distance; ///< stored units
    bool known;
    std::uint32_t color;
  };

  VoxelAccess(const VoxelBlockMap& blocks, std::size_t index)
      : blocks_(blocks), neighbors_(neighborsOf(blocks, index))
  {
  }

  /** Coordinates from -8 to 15. */
  Voxel
  operator()(int x, int y, int z) const
  {
    const std::int64_t number = neighbors_[neighborIndex(x >> 3, y >> 3, z >> 3)];
    if (number < 0)
      return {0, false, 0};
    const VoxelBlock& block = blocks_[number];
    const int voxel = voxelIndex(x & 7, y & 7, z & 7);
    return {float(block.distance[voxel]), block.weight[voxel] != 0, block.color[voxel]};
  }

  /** Slope of the distance at a voxel: central where both neighbours are known. */
  Eigen::Vector3f
  gradient(int x, int y, int z) const
  {
    const float here = (*this)(x, y, z).distance;
    Eigen::Vector3f slope;
    for (int axis = 0; axis < 3; ++axis) {
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      const Voxel after = (*this)(x + dx, y + dy, z + dz);
      const Voxel before = (*this)(x - dx, y - dy, z - dz);
      const float rise = (after.known ? after.distance : here) -
                         (before.known ? before.distance : here);
      const int run = (after.known ? 1 : 0) + (before.known ? 1 : 0);
      slope[axis] = run > 0 ? rise / static_cast<float>(run) : 0.0f;
    }
    return slope;
  }

private:
  const VoxelBlockMap& blocks_;
  BlockNeighbors neighbors_;
};

// Share of the second end in the colour between two; ends without colour do not count.
std::array<std::uint8_t, 3>
blendColors(std::uint32_t first, std::uint32_t second, float t)
{
  Eigen::Vector3f color = Eigen::Vector3f::Constant(128);
  if (first && second)
    color = (1 - t) * decodeColor(first) + t * decodeColor(second);
  else if (first || second)
    color = decodeColor(first ? first : second);
  const Eigen::Vector3f rounded = color.array() + 0.5f;
  return {static_cast<std::uint8_t>(rounded.x()),
          static_cast<std::uint8_t>(rounded.y()),
          static_cast<std::uint8_t>(rounded.z())};
}

void
writeVertex(const VoxelAccess& voxels, const GridEdge& edge, float level,
            const Eigen::Vector3d& block_origin, double voxel_size,
            std::uint32_t vertex, SurfaceMesh& mesh)
{
  const int x = edge.voxel[0], y = edge.voxel[1], z = edge.voxel[2];
  const int dx = edge.axis == 0, dy = edge.axis == 1, dz = edge.axis == 2;
  const auto first = voxels(x, y, z), second = voxels(x + dx, y + dy, z + dz);
  // Off the ends by so much that triangles around a voxel that lies on the surface keep
  // an area in single precision.
  constexpr float margin = 0.01f;
  const float t =
      std::clamp((level - first.distance) / (second.distance - first.distance), margin,
                 1 - margin);
  const Eigen::Vector3d position(x + dx * t, y + dy * t, z + dz * t);
  mesh.vertices[vertex] = (block_origin + voxel_size * position).cast<float>();
  mesh.colors[vertex] = blendColors(first.color, second.color, t);

  Eigen::Vector3f normal =
      (1 - t) * voxels.gradient(x, y, z) + t * voxels.gradient(x + dx, y + dy, z + dz);
  if (!(normal.squaredNorm() > 0))
    normal = Eigen::Vector3f(dx, dy, dz) * (second.distance - first.distance);
  mesh.normals[vertex] = normal.normalized();
}

void
writeVertices(const TSDFVolume::Impl& volume, std::size_t index, float level,
              const BlockSurface& surface, SurfaceMesh& mesh)
{
  if (surface.num_vertices == 0)
    return;
  const VoxelAccess voxels(volume.blocks, index);
  const double voxel_size = volume.options.voxel_size;
  const Eigen::Vector3d origin =
      volume.blocks.coordinatesOf(index).cast<double>() * (block_edge * voxel_size);
  std::uint32_t vertex = surface.first_vertex;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < block_voxels; ++i) {
      const GridEdge edge{{i & 7, i >> 3 & 7, i >> 6}, axis};
      if (surface.hasEdge(edge))
        writeVertex(voxels, edge, level, origin, voxel_size, vertex++, mesh);
    }
}

void
writeTriangles(const VoxelBlockMap& blocks, const BlockSurfaces& surfaces,
               std::size_t index, SurfaceMesh& mesh)
{
  const BlockSurface& surface = *surfaces[index];
  if (surface.num_triangles == 0)
    return;
  const BlockNeighbors neighbors = neighborsOf(blocks, index);
  const auto vertexOf = [&](int cell, int cell_edge) {
    GridEdge edge = cellEdge(cell_edge);
    const int x = edge.voxel[0] + (cell & 7), y = edge.voxel[1] + (cell >> 3 & 7),
              z = edge.voxel[2] + (cell >> 6);
    edge.voxel[0] = x & 7;
    edge.voxel[1] = y & 7;
    edge.voxel[2] = z & 7;
    return surfaces[neighbors[neighborIndex(x >> 3, y >> 3, z >> 3)]]->vertexOf(edge);
  };
  std::uint32_t triangle = surface.first_triangle;
  for (int cell = 0; cell < block_voxels; ++cell)
    for (const int* edges = pcl::triTable[surface.cases[cell]]; *edges != -1;
         edges += 3)
      mesh.triangles[triangle++] = {vertexOf(cell, edges[0]), vertexOf(cell, edges[1]),
                                    vertexOf(cell, edges[2])};
}

// Smallest code whose weight is not less.
int
weightCode(double min_weight)
{
  int low = 1, high = 65535;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (decodeWeight(static_cast<std::uint16_t>(middle)) < min_weight)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

} // namespace

bool
MeshOptions::isValid(std::string* error) const
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = "MeshOptions: " + reason;
    return false;
  };
  if (!(min_weight > 0 && std::isfinite(min_weight)))
    return fail("min_weight " + std::to_string(min_weight) + "; expected a number > 0");
  if (!(iso_level >= 0 && iso_level < 1))
    return fail("iso_level " + std::to_string(iso_level) + "; expected 0 to below 1");
  if (num_threads < 0)
    return fail("num_threads " + std::to_string(num_threads) +
                "; expected 0 (all) or more");
  return true;
}

SurfaceMesh
extractSurface(const TSDFVolume& volume, const MeshOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException(error);
  const VoxelBlockMap& blocks = volume.impl().blocks;
  const int num_threads = resolveNumThreads(options.num_threads);
  const float level = static_cast<float>(options.iso_level) * distance_scale;
  const BlockSurfaces surfaces =
      findSurfaces(blocks, weightCode(options.min_weight), level, num_threads);

  SurfaceMesh mesh;
  std::size_t num_vertices = 0, num_triangles = 0;
  for (const auto& surface : surfaces)
    if (surface) {
      num_vertices += surface->num_vertices;
      num_triangles += surface->num_triangles;
    }
  mesh.vertices.resize(num_vertices);
  mesh.normals.resize(num_vertices);
  mesh.colors.resize(num_vertices);
  mesh.triangles.resize(num_triangles);
#pragma omp parallel for schedule(dynamic, 64) num_threads(num_threads)
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    if (surfaces[i]) {
      writeVertices(volume.impl(), i, level, *surfaces[i], mesh);
      writeTriangles(blocks, surfaces, i, mesh);
    }
  if (options.min_component_triangles > 0)
    removeSmallComponents(mesh, options.min_component_triangles);
  return mesh;
}

} // namespace bundle_icp
