// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/block_allocation.h"
#include "volume/voxel_fusion.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bundle_icp {
namespace {

// Work items of the allocation: many pixels of one share their blocks.
constexpr int patch = 64;

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
    const double size = options.voxel_size * block_edge;
    region_ = *options.region;
    region_->world_from_box.translation() /= size;
    region_->world_from_box.translation() += Eigen::Vector3d::Constant(0.5 / block_edge);
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
  constexpr int tiles = patch / DepthSamples::tile;
  const int tu = u0 / DepthSamples::tile, tv = v0 / DepthSamples::tile;
  for (int y = tv; y < std::min(tv + tiles, samples.tiles_y); ++y)
    for (int x = tu; x < std::min(tu + tiles, samples.tiles_x); ++x)
      farthest = std::max(farthest, samples.depth_range[y * samples.tiles_x + x].y());
  if (farthest <= 0)
    return 0;
  const double focal = std::min(samples.camera.fx, samples.camera.fy);
  return std::clamp(static_cast<int>(block_size * focal / farthest / 2), 1, 8);
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
  const auto truncation = static_cast<float>(options.truncation);
  for (int v = v0; v < std::min(v0 + patch, camera.height); v += step)
    for (int u = u0; u < std::min(u0 + patch, camera.width); u += step)
      visitLayers(samples, u, v, step, truncation, walkBand);
  std::vector<std::uint64_t> found = keys.take();
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&limits](std::uint64_t key) {
                               return !limits.intersects(VoxelBlockMap::coordinates(key));
                             }),
              found.end());
  return found;
}

/** Range of depth over rectangles of tiles, from those of squares of 2^level tiles: four
 *  squares, which may overlap, cover every rectangle (a sparse table). */
class DepthRanges {
public:
  explicit DepthRanges(const DepthSamples& samples)
  : columns_(samples.tiles_x), rows_(samples.tiles_y), levels_{samples.depth_range}
  {
    for (int edge = 1; 2 * edge <= std::max(columns_, rows_); edge *= 2) {
      const std::vector<Eigen::Vector2f>& finer = levels_.back();
      std::vector<Eigen::Vector2f> coarser(finer.size());
      for (int y = 0; y < rows_; ++y)
        for (int x = 0; x < columns_; ++x)
          coarser[at(x, y)] = fourSquares(finer, x, y, std::min(x + edge, columns_ - 1),
                                          std::min(y + edge, rows_ - 1));
      levels_.push_back(std::move(coarser));
    }
  }

  /** Of the tiles x0 ... x1, y0 ... y1. */
  Eigen::Vector2f
  over(int x0, int y0, int x1, int y1) const
  {
    std::size_t level = 0;
    int edge = 1;
    for (const int longer = std::max(x1 - x0, y1 - y0) + 1; 2 * edge <= longer; edge *= 2)
      ++level;
    return fourSquares(levels_[level], x0, y0, std::max(x0, x1 - edge + 1),
                       std::max(y0, y1 - edge + 1));
  }

private:
  std::size_t
  at(int x, int y) const
  {
    return std::size_t(y) * columns_ + x;
  }

  Eigen::Vector2f
  fourSquares(const std::vector<Eigen::Vector2f>& ranges, int x0, int y0, int x1, int y1) const
  {
    const auto both = [](const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
      return Eigen::Vector2f(std::min(a.x(), b.x()), std::max(a.y(), b.y()));
    };
    return both(both(ranges[at(x0, y0)], ranges[at(x1, y0)]),
                both(ranges[at(x0, y1)], ranges[at(x1, y1)]));
  }

  int columns_, rows_;
  std::vector<std::vector<Eigen::Vector2f>> levels_;
};

/** Tells the blocks that a frame can change. */
class VisibilityTest {
public:
  VisibilityTest(const DepthSamples& samples, const Pose& camera_from_world,
                 const TSDFOptions& options)
  : camera_(samples.camera), ranges_(samples), camera_from_world_(camera_from_world),
    options_(options), block_size_(options.voxel_size * block_edge)
  {
    // The outermost voxels, as seen from the first.
    const Eigen::Matrix3d edges =
        camera_from_world.linear() * (options.voxel_size * (block_edge - 1));
    for (int i = 0; i < 8; ++i)
      corners_.col(i) = edges * Eigen::Vector3d(i & 1, i >> 1 & 1, i >> 2 & 1);
  }

  /** Depth [m] up to which the band of a pixel reaches in the block; 0 when neither the band nor,
   *  for blocks that may hold a surface, a pixel's free space reaches the block. */
  float
  operator()(const Eigen::Vector3i& block, bool free_space_matters) const
  {
    const Corners corners =
        corners_.colwise() + camera_from_world_ * (block.cast<double>() * block_size_);
    const double nearest = corners.row(2).minCoeff(), farthest = corners.row(2).maxCoeff();
    if (farthest < options_.min_depth)
      return 0;
    Eigen::AlignedBox2d seen(Eigen::Vector2d(0, 0),
                             Eigen::Vector2d(camera_.width - 1, camera_.height - 1));
    if (nearest >= options_.min_depth) // else it may cover the whole image
      seen.clamp(outline(corners));
    if (seen.isEmpty())
      return 0;
    const Eigen::Array2i first = tileOf(seen.min()), last = tileOf(seen.max());
    const Eigen::Vector2f range = ranges_.over(first.x(), first.y(), last.x(), last.y());
    const float reach =
        range.y() + static_cast<float>(reachBehind(options_, camera_.depth_noise, range.y()));
    const bool reaches =
        reach > nearest && (free_space_matters || range.x() - options_.truncation < farthest);
    return reaches ? reach : 0;
  }

private:
  using Corners = Eigen::Matrix<double, 3, 8>;

  // With the pixels next to it.
  Eigen::AlignedBox2d
  outline(const Corners& corners) const
  {
    const Eigen::Array<double, 1, 8> inverse = corners.row(2).array().inverse();
    const Eigen::Array<double, 1, 8> x = corners.row(0).array() * inverse;
    const Eigen::Array<double, 1, 8> y = corners.row(1).array() * inverse;
    const Eigen::Vector2d margin(1, 1);
    return {camera_.project({x.minCoeff(), y.minCoeff(), 1}) - margin,
            camera_.project({x.maxCoeff(), y.maxCoeff(), 1}) + margin};
  }

  static Eigen::Array2i
  tileOf(const Eigen::Vector2d& pixel)
  {
    return (pixel / DepthSamples::tile).cast<int>().array();
  }

  CameraIntrinsics camera_;
  DepthRanges ranges_;
  Pose camera_from_world_;
  const TSDFOptions& options_;
  double block_size_;
  Corners corners_;
};

} // namespace

std::vector<std::uint64_t>
findBandBlocks(const DepthSamples& samples, const Pose& world_from_camera,
               const TSDFOptions& options, int num_threads)
{
  const double block_size = options.voxel_size * block_edge;
  const BlockLimits limits(options);
  // The first voxel's centre is the block's origin, so its cube reaches half a voxel
  // lower.
  Pose blocks_from_camera = world_from_camera;
  blocks_from_camera.translation() =
      world_from_camera.translation() / block_size + Eigen::Vector3d::Constant(0.5 / block_edge);
  const int across = (samples.camera.width + patch - 1) / patch;
  const int down = (samples.camera.height + patch - 1) / patch;
  std::vector<std::vector<std::uint64_t>> found(std::size_t(across) * down);
#pragma omp parallel for schedule(dynamic) num_threads(num_threads)
  for (int i = 0; i < across * down; ++i)
    found[i] = patchBlocks(samples, i % across * patch, i / across * patch, blocks_from_camera,
                           options, limits, block_size);
  std::vector<std::uint64_t> keys;
  for (const auto& part : found)
    keys.insert(keys.end(), part.begin(), part.end());
  return keys;
}

std::vector<VisibleBlock>
findVisibleBlocks(const VoxelBlockMap& blocks, const DepthSamples& samples,
                  const Pose& camera_from_world, const TSDFOptions& options, int num_threads)
{
  const VisibilityTest reachOf(samples, camera_from_world, options);
  std::vector<float> reach(blocks.size());
#pragma omp parallel for num_threads(num_threads)
  for (std::size_t i = 0; i < blocks.size(); ++i)
    reach[i] = reachOf(blocks.coordinatesOf(i), blocks.mayHoldSurface(i));
  std::vector<VisibleBlock> visible;
  for (std::size_t i = 0; i < reach.size(); ++i)
    if (reach[i] > 0)
      visible.push_back({static_cast<std::uint32_t>(i), reach[i]});
  return visible;
}

} // namespace bundle_icp
