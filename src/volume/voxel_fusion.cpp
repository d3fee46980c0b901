// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "volume/voxel_fusion.h"
#include "common/simd.h"

#include <algorithm>

// One row of a block is one vector: eight voxels, one step for all of them.
namespace bundle_icp {
namespace {

using namespace simd;
static_assert(LANES == BLOCK_EDGE);

constexpr Words LANE_HASH = {0x9e3779b9u, 0x3c6ef372u, 0xdaa66d2bu, 0x78dde6e4u,
                             0x1715609du, 0xb54cda56u, 0x5384540fu, 0xf1bbcdc8u};

struct Row {
  int number;    // within the block
  Ints update;   // mask
  Floats z;      // depth of the voxel [m]
  Floats u, v;   // where it is seen [px]
  Ints nearest;  // the pixel there
  Floats ahead;  // measured depth - z, in truncations
  Floats weight; // of this measurement
  Ints pixel;    // the upper left of the four pixels around (u, v)
  Floats fu, fv; // where (u, v) lies between them, [0, 1]
  Words dither;
};

BUNDLE_ICP_INLINE Ints
truncated(Floats values)
{
  return __builtin_convertvector(values, Ints);
}

// Positions as FusionView::step has them.
struct Positions {
  Floats x, y, z;
};

// Mask of the positions that the image shows, `margin` pixels from its borders, and where.
BUNDLE_ICP_INLINE Ints
project(const FusionView& view, const Positions& at, float margin, Floats& u, Floats& v)
{
  const Floats inverse = 1 / larger(at.z, Floats{} + view.min_depth);
  u = at.x * inverse;
  v = at.y * inverse;
  return (at.z > view.min_depth) & (u >= margin) & (v >= margin) &
         (u < float(view.width - 1) - margin) & (v < float(view.height - 1) - margin);
}

// Whether the image shows all of a block: as it is convex, whether it shows its corners.
BUNDLE_ICP_INLINE bool
showsAll(const FusionView& view, const float corner[3])
{
  constexpr float margin = 0.01f; // more than positions within the block are rounded [px]
  constexpr float edge = BLOCK_EDGE - 1;
  constexpr Floats right = {0, edge, 0, edge, 0, edge, 0, edge};
  constexpr Floats down = {0, 0, edge, edge, 0, 0, edge, edge};
  constexpr Floats back = {0, 0, 0, 0, edge, edge, edge, edge};
  const auto along = [&](int axis) __attribute__((always_inline))
  {
    return corner[axis] + right * view.step[0][axis] + down * view.step[1][axis] +
           back * view.step[2][axis];
  };
  Floats u, v;
  return !any(~project(view, {along(0), along(1), along(2)}, margin, u, v));
}

template <bool all_shown>
BUNDLE_ICP_INLINE void
projectRow(const FusionView& view, const Positions& at, Row& row)
{
  row.z = at.z;
  if constexpr (all_shown) {
    const Floats inverse = 1 / at.z;
    row.u = at.x * inverse;
    row.v = at.y * inverse;
    row.update = Ints{} - 1;
  }
  else {
    Floats u, v;
    row.update = project(view, at, 0, u, v);
    row.u = row.update ? u : 0.0f;
    row.v = row.update ? v : 0.0f;
  }
}

// Share of its weight that a measurement has in a voxel; `ahead` is in truncations. See
// reachBehind().
BUNDLE_ICP_INLINE Floats
shareBehind(const FusionView& view, Floats z, Floats ahead)
{
  const Floats margin = ahead * view.truncation + view.voxel_size + view.sigma(z);
  return smaller(Floats{} + 1, 1 + margin * (1 / (FALL_OFF_VOXELS * view.voxel_size)));
}

// Largest distance behind a surface, in truncations, at which voxels up to depth `farthest` count.
BUNDLE_ICP_INLINE float
largestReach(const FusionView& view, float farthest)
{
  const float noise = std::max(view.sigma(view.min_depth), view.sigma(farthest));
  const float behind = (1 + FALL_OFF_VOXELS) * view.voxel_size + noise;
  return std::min(1.0f, behind * view.inverse_truncation);
}

// Keeps the voxels in front of the surface and those at most `reach` behind it.
BUNDLE_ICP_INLINE void
lookUpNearest(const FusionView& view, float reach, Row& row)
{
  row.nearest = truncated(row.v + 0.5f) * view.width + truncated(row.u + 0.5f);
  const Floats measured = gather<Floats>(view.depth, row.nearest);
  row.ahead = (measured - row.z) * view.inverse_truncation;
  row.update &= (measured > 0) & (row.ahead > -reach);
}

// Depth between the four pixels where they belong to one surface, else that of the
// nearest.
BUNDLE_ICP_INLINE void
interpolateDepth(const FusionView& view, Row& row)
{
  const Ints u0 = truncated(row.u), v0 = truncated(row.v);
  row.pixel = v0 * view.width + u0;
  Floats d00, d01, d10, d11;
  gatherPairs(view.depth, row.pixel, d00, d01);
  gatherPairs(view.depth + view.width, row.pixel, d10, d11);
  const Floats low = smaller(smaller(d00, d01), smaller(d10, d11));
  const Floats high = larger(larger(d00, d01), larger(d10, d11));
  const Ints one_surface = (low > 0) & (high - low < view.edges.tolerance(high));
  const Floats fu = row.u - __builtin_convertvector(u0, Floats);
  const Floats fv = row.v - __builtin_convertvector(v0, Floats);
  const Floats zero{}, one = zero + 1;
  row.fu = one_surface ? fu : (fu < 0.5f ? zero : one);
  row.fv = one_surface ? fv : (fv < 0.5f ? zero : one);
  const Floats upper = d00 + row.fu * (d01 - d00), lower = d10 + row.fu * (d11 - d10);
  const Floats measured = upper + row.fv * (lower - upper);
  const Ints in_band = row.ahead < 1;
  row.ahead = in_band ? (measured - row.z) * view.inverse_truncation : row.ahead;
}

BUNDLE_ICP_INLINE void
weigh(const FusionView& view, Row& row)
{
  row.weight = gather<Floats>(view.weight, row.nearest) * shareBehind(view, row.z, row.ahead);
  row.update &= row.weight > 0;
}

// Equation (7). Returns a mask of the voxels that now lie behind the surface.
BUNDLE_ICP_INLINE Ints
updateDistance(std::uint32_t seed, Row& row, std::int16_t* distance, std::uint16_t* weight)
{
  // Rounding that it dithers does not stall when a measurement moves the mean by less than
  // the last digit. The seed is as good as random from frame to frame.
  row.dither = LANE_HASH + seed;

  const Words old_code = __builtin_convertvector(load<HalfWords>(weight), Words);
  const Floats old_weight =
      old_code ? bitCast<Floats>((old_code << WEIGHT_SHIFT) + weight_base) : Floats{};
  const Floats sum = old_weight + row.weight;
  const Floats share = row.weight / sum;
  const Words sum_bits = bitCast<Words>(sum) + (row.dither >> 20);
  const Ints sum_code = bitCast<Ints>(sum_bits - weight_base) >> WEIGHT_SHIFT;
  const Ints code = smaller(larger(sum_code, Ints{} + 1), Ints{} + 65535);

  const Ints old_distance = __builtin_convertvector(load<Shorts>(distance), Ints);
  const Floats old_value = __builtin_convertvector(old_distance, Floats);
  const Floats one = Floats{} + 1;
  const Floats measured = larger(-one, smaller(one, row.ahead)) * DISTANCE_SCALE;
  const Floats value = old_value + share * (measured - old_value);
  const Floats dither = toFloats(row.dither & 0xffffu) * (1.0f / 65536);
  // Of voxels that are not updated it may be anything, as large as no integer is.
  const Floats dithered = row.update ? value + dither : Floats{};
  const Ints cut = truncated(dithered);
  const Ints down = cut + (__builtin_convertvector(cut, Floats) > dithered); // mask is -1
  const Ints rounded = smaller(down, Ints{} + 32767);

  const auto new_code =
      __builtin_convertvector(row.update ? code : bitCast<Ints>(old_code), HalfWords);
  const auto new_distance = __builtin_convertvector(row.update ? rounded : old_distance, Shorts);
  std::memcpy(weight, &new_code, sizeof(new_code));
  std::memcpy(distance, &new_distance, sizeof(new_distance));
  return row.update & (rounded < 0);
}

// One channel of the new colour, at its place in the voxel's 32 bits.
BUNDLE_ICP_INLINE Words
blendChannel(const Row& row, const Words corners[4], int from, float gain, Floats share, Words old,
             int to, int largest)
{
  const auto get = [from](Words color) __attribute__((always_inline))
  {
    return toFloats(color >> from & 255u);
  };
  const Floats upper = get(corners[0]) + row.fu * (get(corners[1]) - get(corners[0]));
  const Floats lower = get(corners[2]) + row.fu * (get(corners[3]) - get(corners[2]));
  const Floats color = (upper + row.fv * (lower - upper)) * (gain * float(largest) / 255);
  const Floats old_color = toFloats(old >> to & std::uint32_t(largest));
  const Floats dither = toFloats(row.dither >> to / 2 & 1023u) * (1.0f / 1024);
  const Floats mean = old_color + share * (color - old_color);
  const Ints value = truncated(smaller(mean + dither, Floats{} + (largest + 0.5f)));
  return bitCast<Words>(value) << to;
}

// Colour is wanted where the surface can come to lie, not through the whole band.
BUNDLE_ICP_INLINE Ints
nearSurface(const Row& row)
{
  return (row.ahead < 0.5f) & (row.ahead > -0.5f);
}

BUNDLE_ICP_INLINE void
updateColor(const FusionView& view, const Row& row, std::uint32_t* color)
{
  Words corners[4];
  gatherPairs(view.color, row.pixel, corners[0], corners[1]);
  gatherPairs(view.color + view.width, row.pixel, corners[2], corners[3]);
  // The worst of the four says how much the colour is worth.
  const Words quality = smaller(smaller(corners[0] >> QUALITY_SHIFT, corners[1] >> QUALITY_SHIFT),
                                smaller(corners[2] >> QUALITY_SHIFT, corners[3] >> QUALITY_SHIFT));
  const Floats weight = row.weight * toFloats(quality) * (view.color_weight / BEST_QUALITY);

  const Words old = load<Words>(color);
  const Words old_code = old & LARGEST_COLOR_WEIGHT;
  const Floats old_weight =
      old_code ? bitCast<Floats>((old_code << COLOR_WEIGHT_SHIFT) + weight_base) : Floats{};
  const Floats sum = old_weight + weight;
  const Floats share = weight / sum;
  // Other bits of the hash than the distance's weight takes.
  const Words sum_bits = bitCast<Words>(sum) + (row.dither * 0x9e3779b1u >> 10);
  const Ints sum_code = bitCast<Ints>(sum_bits - weight_base) >> COLOR_WEIGHT_SHIFT;
  const Words code =
      bitCast<Words>(smaller(larger(sum_code, Ints{} + 1), Ints{} + int(LARGEST_COLOR_WEIGHT)));

  const Words blended = blendChannel(row, corners, 16, view.gain[2], share, old, RED_SHIFT, 511) |
                        blendChannel(row, corners, 8, view.gain[1], share, old, GREEN_SHIFT, 511) |
                        blendChannel(row, corners, 0, view.gain[0], share, old, BLUE_SHIFT, 255) |
                        code;
  const Ints update = row.update & nearSurface(row);
  const Words result = update ? blended : old;
  std::memcpy(color, &result, sizeof(result));
}

// Mask of a row's voxels that lie in the region.
BUNDLE_ICP_INLINE Ints
insideRegion(const RegionClip& clip, float y, float z)
{
  Ints inside = Ints{} - 1;
  for (int axis = 0; axis < 3; ++axis) {
    const float first = clip.corner[axis] + y * clip.step[1][axis] + z * clip.step[2][axis];
    inside &= magnitude(first + LANE_NUMBER * clip.step[0][axis]) <= clip.half[axis];
  }
  return inside;
}

// Looks up the measurements of a block and returns the number of rows that one may reach.
template <bool all_shown>
BUNDLE_ICP_INLINE int
lookUpRows(const FusionView& view, const float corner[3], float farthest, const RegionClip* clip,
           Row rows[BLOCK_SLAB])
{
  const Floats x = LANE_NUMBER * view.step[0][0], y = LANE_NUMBER * view.step[0][1],
               z = LANE_NUMBER * view.step[0][2];
  const float along_row = std::min(0.0f, (BLOCK_EDGE - 1) * view.step[0][2]);
  const float reach = largestReach(view, farthest);
  int count = 0;
  for (int i = 0; i < BLOCK_SLAB; ++i) {
    const float down = float(i % BLOCK_EDGE), back = float(i / BLOCK_EDGE);
    float first[3];
    for (int axis = 0; axis < 3; ++axis)
      first[axis] = corner[axis] + down * view.step[1][axis] + back * view.step[2][axis];
    if (first[2] + along_row > farthest)
      continue;
    Row& row = rows[count];
    row.number = i;
    projectRow<all_shown>(view, {first[0] + x, first[1] + y, first[2] + z}, row);
    if (clip)
      row.update &= insideRegion(*clip, down, back);
    lookUpNearest(view, reach, row);
    count += any(row.update);
  }
  return count;
}

BUNDLE_ICP_INLINE bool
fuse(const FusionView& view, const float corner[3], float farthest, const RegionClip* clip,
     std::uint32_t seed, VoxelBlock& block)
{
  // Step by step for all rows instead of row by row: the branches that tell which rows need
  // a step are as good as random, and a loop without them overlaps the rows' look-ups.
  Row rows[BLOCK_SLAB];
  const int count = showsAll(view, corner) ? lookUpRows<true>(view, corner, farthest, clip, rows)
                                           : lookUpRows<false>(view, corner, farthest, clip, rows);

  int chosen[BLOCK_SLAB], num_chosen = 0;
  for (int i = 0; i < count; ++i) {
    chosen[num_chosen] = i;
    num_chosen += any(rows[i].update & (rows[i].ahead < 1));
  }
  for (int i = 0; i < num_chosen; ++i)
    interpolateDepth(view, rows[chosen[i]]);

  Ints behind{};
  for (int i = 0; i < count; ++i) {
    Row& row = rows[i];
    weigh(view, row);
    const int voxel = row.number * BLOCK_EDGE;
    behind |= updateDistance(seed + std::uint32_t(row.number) * 0x51ed270bu, row,
                             block.distance + voxel, block.weight + voxel);
  }

  num_chosen = 0;
  if (view.color)
    for (int i = 0; i < count; ++i) {
      chosen[num_chosen] = i;
      num_chosen += any(rows[i].update & nearSurface(rows[i]));
    }
  for (int i = 0; i < num_chosen; ++i)
    updateColor(view, rows[chosen[i]], block.color + rows[chosen[i]].number * BLOCK_EDGE);
  return any(behind);
}

} // namespace

bool
fuseBlock(const FusionView& view, const float corner[3], float farthest, const RegionClip* clip,
          std::uint32_t seed, VoxelBlock& block)
{
  return call<fuse>(view, corner, farthest, clip, seed, block);
}

} // namespace bundle_icp
