// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/parallel.h"

#include "mesh/mesh_editing.h"
#include "volume/cell_cases.h"
#include "volume/depth_filter.h"
#include "volume/tsdf_volume_impl.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/volume/extract_surface.h>

#include <pcl/surface/marching_cubes.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace bundle_icp {
namespace {

/** The voxels of a block and of its neighbours. */
class VoxelAccess {
public:
  struct Voxel {
    float distance;       ///< stored units
    std::uint16_t weight; ///< coded, 0 = not observed
    std::uint32_t color;

    bool
    isKnown() const
    {
      return weight != 0;
    }
  };

  VoxelAccess(const VoxelBlockMap& blocks, std::size_t index)
  : blocks_(blocks), neighbors_(neighborsOf(blocks, index, -1, 1))
  {
  }

  /** Coordinates from -8 to 15. */
  Voxel
  operator()(int x, int y, int z) const
  {
    const std::int64_t number = neighbors_[neighborIndex(x >> 3, y >> 3, z >> 3)];
    if (number < 0)
      return {0, 0, 0};
    const VoxelBlock& block = blocks_[number];
    const int voxel = voxelIndex(x & 7, y & 7, z & 7);
    return {float(block.distance[voxel]), block.weight[voxel], block.color[voxel]};
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
      const float rise =
          (after.isKnown() ? after.distance : here) - (before.isKnown() ? before.distance : here);
      const int run = (after.isKnown() ? 1 : 0) + (before.isKnown() ? 1 : 0);
      slope[axis] = run > 0 ? rise / float(run) : 0.0f;
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
  return {std::uint8_t(rounded.x()), std::uint8_t(rounded.y()), std::uint8_t(rounded.z())};
}

/** Share of the variance of depth that smoothDepth() leaves. Of N averaged pixels fewer than N are
 *  independent: neighbours share half of the variance, over the area that a sensor compares to find
 *  one depth. smoothDepth() also leaves out pixels that may be another surface: more of them, the
 *  wider the last pass reaches and the more a plane is slanted. */
double
smoothedVariance(int radius)
{
  // By the number of passes. Pixels are those of the B-splines that the passes make up, 1 over the
  // sum of their squares; the rest was measured on planes, frontal to slanted by 40 degrees.
  // Without a pass what is left is less than 1, because fusion interpolates between four pixels.
  constexpr std::array<double, 4> averaged{1, 13.4, 66, 264};
  constexpr std::array<double, 4> left_out{0.62, 1, 1.45, 3.2};
  constexpr double shared = 0.5, shared_pixels = 10;
  const int passes = smoothingPasses(radius);
  const double pixels = averaged[passes];
  return left_out[passes] *
         ((1 - shared) / pixels + shared * shared_pixels / (shared_pixels + pixels - 1));
}

/** Writes the vertices of one block after the other into a mesh. */
class VertexWriter {
public:
  VertexWriter(const TSDFVolume::Impl& volume, float level, SurfaceMesh& mesh)
  : volume_(volume), level_(level), mesh_(mesh),
    metres_(volume.options.truncation / DISTANCE_SCALE),
    sigma_(volume.unit_sigma * std::sqrt(smoothedVariance(volume.options.smoothing_radius)))
  {
  }

  void
  write(std::size_t index, const BlockSurface& surface) const
  {
    if (surface.num_vertices == 0)
      return;
    const VoxelAccess voxels(volume_.blocks, index);
    const Eigen::Vector3d origin = volume_.blocks.coordinatesOf(index).cast<double>() *
                                   (BLOCK_EDGE * volume_.options.voxel_size);
    std::uint32_t vertex = surface.first_vertex;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < BLOCK_VOXELS; ++i) {
        const GridEdge edge{{i & 7, i >> 3 & 7, i >> 6}, axis};
        if (surface.hasEdge(edge))
          write(voxels, edge, origin, vertex++);
      }
  }

private:
  void
  write(const VoxelAccess& voxels, const GridEdge& edge, const Eigen::Vector3d& block_origin,
        std::uint32_t vertex) const
  {
    const int x = edge.voxel[0], y = edge.voxel[1], z = edge.voxel[2];
    const int dx = edge.axis == 0, dy = edge.axis == 1, dz = edge.axis == 2;
    const auto first = voxels(x, y, z), second = voxels(x + dx, y + dy, z + dz);
    // Keeps vertices off the ends: triangles around a voxel on the surface then have an area in
    // single precision.
    constexpr float margin = 0.01f;
    const float t = std::clamp((level_ - first.distance) / (second.distance - first.distance),
                               margin, 1 - margin);
    const Eigen::Vector3d position(x + dx * t, y + dy * t, z + dz * t);
    mesh_.vertices[vertex] = (block_origin + volume_.options.voxel_size * position).cast<float>();
    mesh_.colors[vertex] = blendColors(first.color, second.color, t);
    mesh_.weights[vertex] = (1 - t) * decodeWeight(first.weight) + t * decodeWeight(second.weight);

    Eigen::Vector3f slope =
        (1 - t) * voxels.gradient(x, y, z) + t * voxels.gradient(x + dx, y + dy, z + dz);
    if (!(slope.squaredNorm() > 0))
      slope = Eigen::Vector3f(dx, dy, dz) * (second.distance - first.distance);
    mesh_.normals[vertex] = slope.normalized();
    mesh_.deviations[vertex] = deviation(mesh_.weights[vertex], slope.norm());
  }

  /** Turns the deviation along the optical axis into that along the normal: the distance rises
   *  faster, the more the surface is slanted. */
  float
  deviation(float weight, float slope) const
  {
    const double rise = slope * metres_ / volume_.options.voxel_size; // m per m
    return float(sigma_ / std::sqrt(weight) / rise);
  }

  const TSDFVolume::Impl& volume_;
  float level_; ///< stored units
  SurfaceMesh& mesh_;
  double metres_; ///< of a stored unit
  double sigma_;  ///< of a measurement of weight 1, smoothed [m]
};

void
writeTriangles(const VoxelBlockMap& blocks, const BlockSurfaces& surfaces, std::size_t index,
               SurfaceMesh& mesh)
{
  const BlockSurface& surface = *surfaces[index];
  if (surface.num_triangles == 0)
    return;
  const BlockNeighbors neighbors = neighborsOf(blocks, index, 0, 1);
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
  for (int cell = 0; cell < BLOCK_VOXELS; ++cell)
    for (const int* edges = pcl::triTable[surface.cases[cell]]; *edges != -1; edges += 3)
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
    if (decodeWeight(std::uint16_t(middle)) < min_weight)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

void
checkOptions(const MeshOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
}

/** The surface as the voxels have it. */
SurfaceMesh
marchingCubes(const TSDFVolume::Impl& volume, const MeshOptions& options)
{
  const VoxelBlockMap& blocks = volume.blocks;
  const int num_threads = resolveThreads(options.num_threads);
  const float level = float(options.iso_level) * DISTANCE_SCALE;
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
  mesh.weights.resize(num_vertices);
  mesh.deviations.resize(num_vertices);
  mesh.triangles.resize(num_triangles);
  const VertexWriter vertices(volume, level, mesh);
#pragma omp parallel for schedule(dynamic, 64) num_threads(num_threads)
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    if (surfaces[i]) {
      vertices.write(i, *surfaces[i]);
      writeTriangles(blocks, surfaces, i, mesh);
    }
  return mesh;
}

/** Smoothed, cleaned and decimated. */
SurfaceMesh
finishMesh(SurfaceMesh mesh, const MeshOptions& options, MeshReport* report)
{
  MeshSmoothingOptions smoothing = options.smoothing;
  smoothing.num_threads = resolveThreads(options.num_threads);
  smoothMesh(mesh, smoothing);
  MeshReport unused;
  MeshReport& result = report ? *report : unused;
  result.cleaning = cleanExtracted(mesh, options.cleaning);
  result.decimation = decimateMesh(mesh, options.decimation);
  return mesh;
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
    return fail("num_threads " + std::to_string(num_threads) + "; expected 0 (all) or more");
  return smoothing.isValid(error) && cleaning.isValid(error) && decimation.isValid(error);
}

SurfaceMesh
extractSurface(const TSDFVolume& volume, const MeshOptions& options, MeshReport* report)
{
  checkOptions(options);
  return finishMesh(marchingCubes(volume.impl(), options), options, report);
}

SurfaceMesh
extractSurface(TSDFVolume&& volume, const MeshOptions& options, MeshReport* report)
{
  checkOptions(options);
  std::optional<TSDFVolume> taken(std::move(volume));
  SurfaceMesh mesh = marchingCubes(taken->impl(), options);
  taken.reset(); // before smoothing needs more than the mesh itself
  return finishMesh(std::move(mesh), options, report);
}

} // namespace bundle_icp
