// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/voxel_sampler.h"

namespace bundle_icp {
namespace {

Eigen::Vector3i
roundDown(const Eigen::Vector3f& position)
{
  return position.array().floor().cast<int>();
}

int
indexInBlock(const Eigen::Vector3i& voxel)
{
  return (voxel.z() & 7) * BLOCK_SLAB + (voxel.y() & 7) * BLOCK_EDGE + (voxel.x() & 7);
}

} // namespace

const VoxelBlock*
VoxelSampler::block(const Eigen::Vector3i& voxel)
{
  const Eigen::Vector3i coordinates(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3);
  if (coordinates != last_coordinates_) {
    last_ = blocks_.find(coordinates);
    last_coordinates_ = coordinates;
  }
  return last_;
}

std::optional<float>
VoxelSampler::nearest(const Eigen::Vector3f& position)
{
  const Eigen::Vector3i voxel = roundDown(position + Eigen::Vector3f::Constant(0.5f));
  const VoxelBlock* const found = block(voxel);
  if (!found || found->weight[indexInBlock(voxel)] == 0)
    return std::nullopt;
  return float(found->distance[indexInBlock(voxel)]) / DISTANCE_SCALE;
}

std::optional<float>
VoxelSampler::distance(const Eigen::Vector3f& position)
{
  const Eigen::Vector3i cell = roundDown(position);
  return distance(cell, position - cell.cast<float>());
}

std::optional<float>
VoxelSampler::distance(const Eigen::Vector3i& cell, const Eigen::Vector3f& within)
{
  const VoxelBlock* const home = block(cell);
  const Eigen::Vector3i in_block(cell.x() & 7, cell.y() & 7, cell.z() & 7);
  const bool is_inside = in_block.maxCoeff() < BLOCK_EDGE - 1;
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i offset(corner & 1, corner >> 1 & 1, corner >> 2);
    const Eigen::Vector3i voxel = cell + offset;
    const VoxelBlock* const found = is_inside ? home : block(voxel);
    const int index = indexInBlock(voxel);
    if (!found || found->weight[index] == 0)
      return std::nullopt;
    float share = 1;
    for (int axis = 0; axis < 3; ++axis)
      share *= offset[axis] ? within[axis] : 1 - within[axis];
    sum += share * float(found->distance[index]);
  }
  return sum / DISTANCE_SCALE;
}

std::optional<Eigen::Vector3f>
VoxelSampler::gradient(const Eigen::Vector3f& position)
{
  Eigen::Vector3f result;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3f step = Eigen::Vector3f::Unit(axis);
    const std::optional<float> ahead = distance(position + step);
    const std::optional<float> behind = distance(position - step);
    if (!ahead || !behind)
      return std::nullopt;
    result[axis] = (*ahead - *behind) / 2;
  }
  return result;
}

std::uint32_t
VoxelSampler::color(const Eigen::Vector3f& position)
{
  const Eigen::Vector3i voxel = roundDown(position + Eigen::Vector3f::Constant(0.5f));
  const VoxelBlock* const found = block(voxel);
  return found ? found->color[indexInBlock(voxel)] : 0;
}

} // namespace bundle_icp
