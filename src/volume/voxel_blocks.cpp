// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/voxel_blocks.h"

namespace bundle_icp {

void
VoxelBlockMap::insert(std::uint64_t key)
{
  const auto index = std::uint32_t(keys_.size());
  if (!index_of_.emplace(key, index).second)
    return;
  if (index / chunk_blocks == chunks_.size())
    chunks_.push_back(std::make_unique<VoxelBlock[]>(chunk_blocks));
  keys_.push_back(key);
  may_hold_surface_.push_back(0);
}

std::int64_t
VoxelBlockMap::indexOf(const Eigen::Vector3i& block) const
{
  const auto found = index_of_.find(key(block));
  return found == index_of_.end() ? -1 : std::int64_t(found->second);
}

const VoxelBlock*
VoxelBlockMap::find(const Eigen::Vector3i& block) const
{
  const std::int64_t index = indexOf(block);
  return index < 0 ? nullptr : &(*this)[index];
}

std::size_t
VoxelBlockMap::memoryBytes() const
{
  // A node of the index holds key, number and the link to the next one.
  return chunks_.size() * chunk_blocks * sizeof(VoxelBlock) +
         keys_.capacity() * sizeof(std::uint64_t) + index_of_.size() * 3 * sizeof(std::uint64_t) +
         index_of_.bucket_count() * sizeof(void*);
}

} // namespace bundle_icp
