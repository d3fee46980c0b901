// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/visible_blocks.h"
#include "volume/fusion_view.h"

#include <algorithm>

namespace bundle_icp {
namespace {

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
    options_(options), block_size_(options.voxel_size * BLOCK_EDGE)
  {
    // The outermost voxels, as seen from the first.
    const Eigen::Matrix3d edges =
        camera_from_world.linear() * (options.voxel_size * (BLOCK_EDGE - 1));
    for (int i = 0; i < 8; ++i)
      corners_.col(i) = edges * Eigen::Vector3d(i & 1, i >> 1 & 1, i >> 2 & 1);
  }

  /** How far the band of a pixel reaches in the block [m]; 0 when neither that nor, for blocks
   *  that may hold a surface, a pixel's free space reaches it. */
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
    const float reach = range.y() + float(reachBehind(options_, camera_.depth_noise, range.y()));
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
      visible.push_back({std::uint32_t(i), reach[i]});
  return visible;
}

} // namespace bundle_icp
