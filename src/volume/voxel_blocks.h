// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <memory>
#include <unordered_map>
#include <vector>

namespace bundle_icp {

constexpr int BLOCK_EDGE = 8;
constexpr int BLOCK_SLAB = BLOCK_EDGE * BLOCK_EDGE;
constexpr int BLOCK_VOXELS = BLOCK_SLAB * BLOCK_EDGE;
/** Distances are stored in units of truncation / DISTANCE_SCALE. */
constexpr float DISTANCE_SCALE = 32767;

/** 8^3 voxels, x fastest, as arrays so that rows can be processed by vector
 *  instructions. All zero = nothing observed. */
struct alignas(64) VoxelBlock {
  std::int16_t distance[BLOCK_VOXELS];
  std::uint16_t weight[BLOCK_VOXELS]; ///< coded, see decodeWeight()
  /** 9 bits red, 9 green, 8 blue, and 6 of the colour's own weight; 0 = none */
  std::uint32_t color[BLOCK_VOXELS];
};

/** Weights are floats without sign, with 5 bits of exponent and 11 of mantissa: 2^-14
 *  to 2^18, so that neither a far measurement nor a thousand near ones leave the range. */
constexpr std::uint32_t weight_base = (127u - 14u) << 23;
constexpr int WEIGHT_SHIFT = 12;

inline float
decodeWeight(std::uint16_t code)
{
  const std::uint32_t bits = (std::uint32_t(code) << WEIGHT_SHIFT) + weight_base;
  float weight;
  std::memcpy(&weight, &bits, sizeof(weight));
  return code ? weight : 0.0f;
}

/** A colour is weighted apart from the distance, by numbers of the same range with 1 bit
 *  of mantissa: rounding that is dithered keeps their sum right on average. */
constexpr int COLOR_WEIGHT_SHIFT = 22;
constexpr std::uint32_t LARGEST_COLOR_WEIGHT = 63;

/** Where the channels lie in a voxel's 32 bits. */
constexpr int RED_SHIFT = 23, GREEN_SHIFT = 14, BLUE_SHIFT = 6;

/** Red, green and blue in [0, 255]. */
inline Eigen::Vector3f
decodeColor(std::uint32_t color)
{
  return {float(color >> RED_SHIFT) * (255.0f / 511),
          float(color >> GREEN_SHIFT & 511) * (255.0f / 511), float(color >> BLUE_SHIFT & 255)};
}

/** The blocks of a volume. They are numbered in the order of insertion and never move. */
class VoxelBlockMap {
public:
  /** Coordinates lie in [-limit, limit). */
  static constexpr int limit = 1 << 20;

  /** One number for three coordinates; ordered by z, y, x. */
  static std::uint64_t
  key(const Eigen::Vector3i& block)
  {
    const auto field = [](int value) { return std::uint64_t(value + limit); };
    return field(block.z()) << 42 | field(block.y()) << 21 | field(block.x());
  }

  static Eigen::Vector3i
  coordinates(std::uint64_t key)
  {
    const auto field = [key](int shift) { return int(key >> shift & 0x1fffff) - limit; };
    return {field(0), field(21), field(42)};
  }

  /** Adds a block of zeros unless it exists. */
  void
  insert(std::uint64_t key);

  const VoxelBlock*
  find(const Eigen::Vector3i& block) const;

  std::size_t
  size() const
  {
    return keys_.size();
  }

  Eigen::Vector3i
  coordinatesOf(std::size_t index) const
  {
    return coordinates(keys_[index]);
  }

  VoxelBlock&
  operator[](std::size_t index)
  {
    return chunks_[index / chunk_blocks][index % chunk_blocks];
  }

  const VoxelBlock&
  operator[](std::size_t index) const
  {
    return chunks_[index / chunk_blocks][index % chunk_blocks];
  }

  /** False until a voxel of the block lies behind a surface: before that, free space has nothing to
   *  carve in the block. */
  bool
  mayHoldSurface(std::size_t index) const
  {
    return may_hold_surface_[index] != 0;
  }

  /** Threads may call this for different blocks. */
  void
  setMayHoldSurface(std::size_t index)
  {
    may_hold_surface_[index] = 1;
  }

  /** Number of a block, or -1. */
  std::int64_t
  indexOf(const Eigen::Vector3i& block) const;

  std::size_t
  memoryBytes() const;

private:
  static constexpr std::size_t chunk_blocks = 256;

  std::vector<std::uint64_t> keys_;
  std::vector<std::uint8_t> may_hold_surface_; // not bool: written by several threads
  std::vector<std::unique_ptr<VoxelBlock[]>> chunks_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_of_;
};

} // namespace bundle_icp
