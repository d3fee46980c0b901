// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/block_allocation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bundle_icp {
namespace {

// Work items of the allocation: many pixels of one share their blocks.
constexpr int PATCH = 64;

/** Collects keys and drops most repetitions at once. */
class KeyCollector {
public:
  void
  add(std::uint64_t key)
  {
    std::uint64_t& recent = recent_[key * 0x9e3779b97f4a7c15u >> 56];
    if (recent == key)
      return;
    recent = key;
    keys_.push_back(key);
  }

  std::vector<std::uint64_t>
  take()
  {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    return std::move(keys_);
  }

private:
  std::array<std::uint64_t, 256> recent_{}; // key 0 is the outermost corner of the space
  std::vector<std::uint64_t> keys_;
};

/** Where blocks may be allocated. Coordinates are in blocks. */
class BlockLimits {
public:
  explicit BlockLimits(const TSDFOptions& options)
  : low_(Eigen::Vector3i::Constant(-VoxelBlockMap::limit + 1)),
    high_(Eigen::Vector3i::Constant(VoxelBlockMap::limit - 2))
  {
    if (!options.region)
      return;
    const double size = options.voxel_size * BLOCK_EDGE;
    region_ = *options.region;
    region_->world_from_box.translation() /= size;
    region_->world_from_box.translation() += Eigen::Vector3d::Constant(0.5 / BLOCK_EDGE);
    region_->size /= size;
    const Eigen::AlignedBox3d bounds = region_->bounds();
    const Eigen::Vector3d low = low_.cast<double>(), high = high_.cast<double>();
    const Eigen::Vector3d first = bounds.min().array().floor();
    const Eigen::Vector3d last = bounds.max().array().floor();
    low_ = first.cwiseMax(low).cwiseMin(high).cast<int>();
    high_ = last.cwiseMax(low).cwiseMin(high).cast<int>();
  }

  /** In the axis-aligned box around the region. */
  bool
  boundsContain(const Eigen::Vector3i& block) const
  {
    return (block.array() >= low_.array()).all() && (block.array() <= high_.array()).all();
  }

  /** Two boxes are apart when an axis of one, or the product of an axis of each,
   * separates them (Gottschalk, Lin, Manocha, SIGGRAPH 1996). */
  bool
  intersects(const Eigen::Vector3i& block) const
  {
    if (!region_ || region_->isAligned())
      return true;
    const Eigen::Matrix3d axes = region_->world_from_box.linear();
    const Eigen::Vector3d half = 0.5 * region_->size;
    const Eigen::Vector3d apart = block.cast<double>() + Eigen::Vector3d::Constant(0.5) -
                                  region_->world_from_box.translation();
    const auto separates = [&](const Eigen::Vector3d& axis) {
      const double reach = 0.5 * axis.lpNorm<1>() + half.dot((axes.transpose() * axis).cwiseAbs());
      return std::abs(apart.dot(axis)) > reach;
    };
    for (int i = 0; i < 3; ++i) {
      if (separates(axes.col(i)))
        return false;
      for (int j = 0; j < 3; ++j)
        if (separates(Eigen::Vector3d::Unit(i).cross(axes.col(j))))
          return false;
    }
    return true;
  }

private:
  Eigen::Vector3i low_, high_;
  std::optional<OrientedBox> region_;
};

// Visits the blocks on a segment from one to the next across the nearest face
// (Amanatides and Woo, 1987). Coordinates are in blocks.
void
walkSegment(const Eigen::Vector3d& begin, const Eigen::Vector3d& end, const BlockLimits& limits,
            KeyCollector& keys)
{
  Eigen::Vector3i block = begin.array().floor().cast<int>();
  const Eigen::Vector3i last = end.array().floor().cast<int>();
  const Eigen::Vector3d direction = end - begin;
  Eigen::Vector3d next, delta;
  for (int axis = 0; axis < 3; ++axis) {
    const double speed = std::abs(direction[axis]);
    const double ahead =
        direction[axis] > 0 ? block[axis] + 1 - begin[axis] : begin[axis] - block[axis];
    delta[axis] = speed > 0 ? 1 / speed : INFINITY;
    next[axis] = speed > 0 ? ahead / speed : INFINITY;
  }
  for (int steps = (last - block).cwiseAbs().sum(); steps >= 0; --steps) {
    if (limits.boundsContain(block))
      keys.add(VoxelBlockMap::key(block));
    int axis = next[0] < next[1] ? 0 : 1;
    axis = next[2] < next[axis] ? 2 : axis;
    block[axis] += direction[axis] > 0 ? 1 : -1;
    next[axis] += delta[axis];
  }
}

// Pixels between samples such that half a block at the patch's largest depth gets one.
int
sampleStep(const DepthSamples& samples, int u0, int v0, double block_size)
{
  float farthest = 0;
  constexpr int tiles = PATCH / DepthSamples::tile;
  const int tu = u0 / DepthSamples::tile, tv = v0 / DepthSamples::tile;
  for (int y = tv; y < std::min(tv + tiles, samples.tiles_y); ++y)
    for (int x = tu; x < std::min(tu + tiles, samples.tiles_x); ++x)
      farthest = std::max(farthest, samples.depth_range[y * samples.tiles_x + x].y());
  if (farthest <= 0)
    return 0;
  const double focal = std::min(samples.camera.fx, samples.camera.fy);
  return std::clamp(int(block_size * focal / farthest / 2), 1, 8);
}

/** Calls visit(u, v) for enough pixels of a cell that their bands contain the bands of all its
 *  pixels: the pixel in the middle, and each pixel that differs by more than the truncation from
 *  the middle and from the pixel before, as where something thin is in front of something far. */
template <typename Visit>
void
visitLayers(const DepthSamples& samples, int u0, int v0, int step, float truncation,
            const Visit& visit)
{
  const auto depthAt = [&samples](int u, int v) {
    const std::size_t pixel = std::size_t(v) * samples.camera.width + u;
    return samples.weight[pixel] > 0 ? samples.depth[pixel] : 0.0f;
  };
  const int u1 = std::min(u0 + step, samples.camera.width);
  const int v1 = std::min(v0 + step, samples.camera.height);
  const int middle_u = std::min(u0 + step / 2, u1 - 1), middle_v = std::min(v0 + step / 2, v1 - 1);
  const float middle = depthAt(middle_u, middle_v);
  if (middle > 0)
    visit(middle_u, middle_v);
  float last = middle;
  for (int v = v0; v < v1; ++v)
    for (int u = u0; u < u1; ++u) {
      const float z = depthAt(u, v);
      if (z > 0 && std::abs(z - middle) > truncation && std::abs(z - last) > truncation) {
        visit(u, v);
        last = z;
      }
    }
}

std::vector<std::uint64_t>
patchBlocks(const DepthSamples& samples, int u0, int v0, const Pose& blocks_from_camera,
            const TSDFOptions& options, const BlockLimits& limits, double block_size)
{
  const CameraIntrinsics& camera = samples.camera;
  const int step = sampleStep(samples, u0, v0, block_size);
  if (step == 0)
    return {};
  KeyCollector keys;
  const Eigen::Matrix3d rotation = blocks_from_camera.linear() / block_size;
  const Eigen::Vector3d origin = blocks_from_camera.translation();
  const auto walkBand = [&](int u, int v) {
    const double z = samples.depth[std::size_t(v) * camera.width + u];
    const Eigen::Vector3d ray = rotation * camera.unproject(u, v, 1);
    walkSegment(origin + (z - options.truncation) * ray, origin + (z + options.truncation) * ray,
                limits, keys);
  };
  const auto truncation = float(options.truncation);
  for (int v = v0; v < std::min(v0 + PATCH, camera.height); v += step)
    for (int u = u0; u < std::min(u0 + PATCH, camera.width); u += step)
      visitLayers(samples, u, v, step, truncation, walkBand);
  std::vector<std::uint64_t> found = keys.take();
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&limits](std::uint64_t key) {
                               return !limits.intersects(VoxelBlockMap::coordinates(key));
                             }),
              found.end());
  return found;
}

} // namespace

std::vector<std::uint64_t>
findBandBlocks(const DepthSamples& samples, const Pose& world_from_camera,
               const TSDFOptions& options, int num_threads)
{
  const double block_size = options.voxel_size * BLOCK_EDGE;
  const BlockLimits limits(options);
  // The first voxel's centre is the block's origin, so its cube reaches half a voxel
  // lower.
  Pose blocks_from_camera = world_from_camera;
  blocks_from_camera.translation() =
      world_from_camera.translation() / block_size + Eigen::Vector3d::Constant(0.5 / BLOCK_EDGE);
  const int across = (samples.camera.width + PATCH - 1) / PATCH;
  const int down = (samples.camera.height + PATCH - 1) / PATCH;
  std::vector<std::vector<std::uint64_t>> found(std::size_t(across) * down);
#pragma omp parallel for schedule(dynamic) num_threads(num_threads)
  for (int i = 0; i < across * down; ++i)
    found[i] = patchBlocks(samples, i % across * PATCH, i / across * PATCH, blocks_from_camera,
                           options, limits, block_size);
  std::vector<std::uint64_t> keys;
  for (const auto& part : found)
    keys.insert(keys.end(), part.begin(), part.end());
  return keys;
}

} // namespace bundle_icp
