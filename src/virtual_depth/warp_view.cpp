// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "virtual_depth/warp_view.h"

#include "common/depth_edges.h"
#include "virtual_depth/warp_target.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace bundle_icp {
namespace {

using simd::larger;
using simd::smaller;

/** Minimum distance from the virtual camera at which anything is rendered [m]. */
constexpr float NEAR_PLANE = 0.05f;
/** Largest useful mesh cell in the virtual view [px]. */
constexpr float MAX_CELL = 24;
/** Smallest area of a cell [px^2]: a sliver carries no depth; negative means seen from
 * behind. */
constexpr float MIN_AREA = 1e-4f;
/** Cells from now whose pixel is fetched ahead of use. */
constexpr std::size_t PREFETCHED = 48;
/** Overlap of neighbouring cells, as a share of a cell: closes the seams that rounding
 * opens. */
constexpr float SEAM = 2e-3f;

/** One row of the mesh's vertices in the virtual image, and which neighbours they link
 * to. */
struct VertexRow {
  std::vector<float> u, v, inverse_z;
  std::vector<float> valid, link_right, link_down;

  explicit VertexRow(std::size_t width)
  : u(width), v(width), inverse_z(width), valid(width), link_right(width), link_down(width)
  {
  }
};

/** Pixel (column, row) at depth z of the view lies at z (origin + column x + row y) +
 *  translation in the virtual camera's homogeneous pixel coordinates. */
struct Warp {
  float x[3], y[3], origin[3], translation[3];

  Warp(const CameraIntrinsics& from, const CameraIntrinsics& to, const Pose& to_from)
  {
    Eigen::Matrix3d k_from, k_to;
    k_from << from.fx, 0, from.cx, 0, from.fy, from.cy, 0, 0, 1;
    k_to << to.fx, 0, to.cx, 0, to.fy, to.cy, 0, 0, 1;
    const Eigen::Matrix3d m = k_to * to_from.linear() * k_from.inverse();
    const Eigen::Vector3d t = k_to * to_from.translation();
    for (int i = 0; i < 3; ++i) {
      x[i] = float(m(i, 0));
      y[i] = float(m(i, 1));
      origin[i] = float(m(i, 2));
      translation[i] = float(t[i]);
    }
  }
};

BUNDLE_ICP_INLINE void
warpRow(const float* z, const float* weight, int width, int row, const Warp& warp, VertexRow& out)
{
  float start[3];
  for (int i = 0; i < 3; ++i)
    start[i] = warp.origin[i] + float(row) * warp.y[i];
#pragma omp simd
  for (int c = 0; c < width; ++c) {
    const float column = float(c);
    const float measured = z[c];
    const bool usable = weight[c] > 0;
    const float depth = usable ? measured : 1.0f;
    const float a = depth * (start[0] + column * warp.x[0]) + warp.translation[0];
    const float b = depth * (start[1] + column * warp.x[1]) + warp.translation[1];
    const float w = depth * (start[2] + column * warp.x[2]) + warp.translation[2];
    const bool in_front = usable & (w > NEAR_PLANE);
    const float divisor = in_front ? w : 1.0f;
    const float inverse = 1 / divisor;
    out.inverse_z[c] = inverse;
    out.u[c] = a * inverse;
    out.v[c] = b * inverse;
    out.valid[c] = in_front ? 1.0f : 0.0f;
  }
}

BUNDLE_ICP_INLINE void
linkVertices(const float* a, const float* b, const float* valid_a, const float* valid_b, int width,
             DepthEdges linked, float* links)
{
#pragma omp simd
  for (int c = 0; c < width; ++c)
    links[c] = linked(a[c], b[c]) * valid_a[c] * valid_b[c];
}

struct Vertex {
  float u, v, inverse_z;
};

BUNDLE_ICP_INLINE Vertex
vertex(const VertexRow& row, int c)
{
  return {row.u[c], row.v[c], row.inverse_z[c]};
}

/** A cell of the mesh: corner `o`, the ends `a` and `b` of the two edges that leave it,
 * and for a whole quad the corner `c` opposite to it. */
struct Cell {
  Vertex o, a, b, c;
  bool quad;
  int pixel_o, step_a, step_b; // source pixel of o, and steps to those of a and b
};

/** Pixels whose centres lie in the bounding box of a cell; empty when u0 > u1 or v0 >
 * v1. */
struct Box {
  int u0, u1, v0, v1;
};

/** The same for a whole row of quads. Most quads meet one pixel; that is rendered here.
 */
struct RowCells {
  std::vector<int> u0, u1, v0, v1;
  std::vector<int> single; // 1 = rendered by the three below
  std::vector<int> index;  // pixel that is met, -1 = none
  std::vector<int> source;
  std::vector<float> inverse_z;
  std::vector<int> hits, others; // quads of one pixel that meet it; those of several

  explicit RowCells(std::size_t width)
  : u0(width), u1(width), v0(width), v1(width), single(width), index(width), source(width),
    inverse_z(width), hits(width), others(width)
  {
  }
};

/** Position of a pixel in a cell: shares of the edges to `a` and to `b`. */
struct Place {
  float s, t, inverse_z;
  float area; ///< of the parallelogram of both edges [px^2]
};

/** A quad is nearly a parallelogram: a fixed-point step inverts its bilinear map. */
BUNDLE_ICP_INLINE Place
locate(Vertex o, Vertex a, Vertex b, Vertex c, bool quad, int u, int v)
{
  const float ax = a.u - o.u, ay = a.v - o.v, bx = b.u - o.u, by = b.v - o.v;
  const float gx = quad ? c.u - a.u - bx : 0, gy = quad ? c.v - a.v - by : 0;
  const float determinant = ax * by - ay * bx, scale = 1 / determinant;
  const float x = float(u) - o.u, y = float(v) - o.v;
  float s = (x * by - y * bx) * scale, t = (ax * y - ay * x) * scale;
  const float xk = x - s * t * gx, yk = y - s * t * gy;
  s = (xk * by - yk * bx) * scale;
  t = (ax * yk - ay * xk) * scale;
  const float da = a.inverse_z - o.inverse_z, db = b.inverse_z - o.inverse_z;
  const float dc = quad ? c.inverse_z - a.inverse_z - db : 0;
  return {s, t, o.inverse_z + s * da + t * db + s * t * dc, determinant};
}

/** Number of edges of the quad between columns c and c + 1 that lie on a surface. */
BUNDLE_ICP_INLINE float
numLinks(const VertexRow& top, const VertexRow& bottom, int c)
{
  return top.link_right[c] + bottom.link_right[c] + top.link_down[c] + top.link_down[c + 1];
}

/** First pixel at or after a coordinate, in an image of `size` pixels. */
BUNDLE_ICP_INLINE int
firstPixel(float low, float size)
{
  const float start = smaller(larger(low, 0.0f), size);
  const int before = int(start); // std::ceil() is not for vector instructions
  return before + (float(before) < start);
}

/** Last pixel at or before a coordinate, -1 = none. */
BUNDLE_ICP_INLINE int
lastPixel(float high, float size)
{
  return int(larger(smaller(high + 1, size), 0.0f)) - 1;
}

BUNDLE_ICP_INLINE void
boundQuads(const VertexRow& top, const VertexRow& bottom, int quads, const WarpTarget& target,
           RowCells& cells)
{
  const float width = float(target.width), height = float(target.height);
  const float *tu = top.u.data(), *tv = top.v.data();
  const float *bu = bottom.u.data(), *bv = bottom.v.data();
#pragma omp simd
  for (int c = 0; c < quads; ++c) {
    const float u_min = smaller(smaller(tu[c], tu[c + 1]), smaller(bu[c], bu[c + 1]));
    const float u_max = larger(larger(tu[c], tu[c + 1]), larger(bu[c], bu[c + 1]));
    const float v_min = smaller(smaller(tv[c], tv[c + 1]), smaller(bv[c], bv[c + 1]));
    const float v_max = larger(larger(tv[c], tv[c + 1]), larger(bv[c], bv[c + 1]));
    const float du = u_max - u_min, dv = v_max - v_min;
    cells.u0[c] = firstPixel(u_min - SEAM * du, width);
    cells.v0[c] = firstPixel(v_min - SEAM * dv, height);
    cells.v1[c] = lastPixel(v_max + SEAM * dv, height);
    // At least two linked edges make a cell. Without branches, for vector instructions.
    const float linked = numLinks(top, bottom, c) >= 2 ? 1.0f : 0.0f;
    const float usable = larger(du, dv) <= MAX_CELL ? linked : 0.0f;
    cells.u1[c] = lastPixel(usable * (u_max + SEAM * du + 1) - 1, width);
  }
}

/** Renders the quads that meet a single pixel: as renderCell(), for a whole row. */
BUNDLE_ICP_INLINE void
sampleQuads(const VertexRow& top, const VertexRow& bottom, int quads, int row, int image_width,
            RowCells& cells)
{
  const int first = row * (quads + 1);
#pragma omp simd
  for (int c = 0; c < quads; ++c) {
    const int u = cells.u0[c], v = cells.v0[c];
    const Place at = locate(vertex(top, c), vertex(top, c + 1), vertex(bottom, c),
                            vertex(bottom, c + 1), true, u, v);
    cells.inverse_z[c] = at.inverse_z;
    cells.source[c] = first + c + (at.s > 0.5f ? 1 : 0) + (at.t > 0.5f ? quads + 1 : 0);
    // The distance by which the pixel lies outside, so that one comparison decides.
    const float outside = larger(larger(-at.s, -at.t), larger(at.s, at.t) - 1);
    const float area = outside <= SEAM ? at.area : 0.0f;
    const int pixel = v * image_width + u;
    cells.index[c] = area > MIN_AREA ? pixel : -1;
    const int more = (cells.u1[c] - u) | (cells.v1[c] - v);
    const int whole = numLinks(top, bottom, c) >= 4 ? 0 : 1;
    cells.single[c] = (more | whole) == 0 ? 1 : 0;
  }
}

inline void
renderCell(const Cell& cell, const Box& box, WarpTarget& target)
{
  for (int v = box.v0; v <= box.v1; ++v)
    for (int u = box.u0; u <= box.u1; ++u) {
      const Place at = locate(cell.o, cell.a, cell.b, cell.c, cell.quad, u, v);
      const float farthest = cell.quad ? larger(at.s, at.t) : at.s + at.t;
      if (at.area > MIN_AREA && at.s >= -SEAM && at.t >= -SEAM && farthest <= 1 + SEAM)
        target.add(v * target.width + u, at.inverse_z,
                   cell.pixel_o + (at.s > 0.5f ? cell.step_a : 0) +
                       (at.t > 0.5f ? cell.step_b : 0));
    }
}

/** A cell that may meet several pixels. Where one of four vertices lies on another
 * surface, the triangle of the other three remains; from its corner, `b` follows `a`
 * clockwise. */
void
renderOther(const VertexRow& top, const VertexRow& bottom, int row, int width, int c,
            const RowCells& cells, WarpTarget& target)
{
  const std::size_t i = std::size_t(c);
  const Box box{cells.u0[i], cells.u1[i], cells.v0[i], cells.v1[i]};
  const bool t = top.link_right[i] > 0, b = bottom.link_right[i] > 0;
  const bool l = top.link_down[i] > 0, r = top.link_down[i + 1] > 0;
  const int pixel = row * width + c;
  const Vertex v00 = vertex(top, c), v10 = vertex(top, c + 1);
  const Vertex v01 = vertex(bottom, c), v11 = vertex(bottom, c + 1);
  if (t && b && l && r)
    renderCell({v00, v10, v01, v11, true, pixel, 1, width}, box, target);
  else if (t && l)
    renderCell({v00, v10, v01, v11, false, pixel, 1, width}, box, target);
  else if (t && r)
    renderCell({v10, v11, v00, v01, false, pixel + 1, width, -1}, box, target);
  else if (b && r)
    renderCell({v11, v01, v10, v00, false, pixel + 1 + width, -1, -width}, box, target);
  else if (b && l)
    renderCell({v01, v00, v11, v10, false, pixel + width, -width, 1}, box, target);
}

/** Cells between two rows of vertices. Which of them meet a pixel is as good as random:
 * listed first, they cost no mispredicted branch. */
void
renderBetween(const VertexRow& top, const VertexRow& bottom, int row, int width, RowCells& cells,
              WarpTarget& target)
{
  std::size_t hits = 0, others = 0;
  for (int c = 0; c + 1 < width; ++c) {
    const std::size_t i = std::size_t(c);
    const bool single = cells.single[i] != 0;
    const bool empty = (int(cells.u0[i] > cells.u1[i]) | int(cells.v0[i] > cells.v1[i])) != 0;
    cells.hits[hits] = cells.others[others] = c;
    hits += single & (cells.index[i] >= 0);
    others += !single & !empty;
  }
  for (std::size_t k = 0; k < hits; ++k) {
    const std::size_t ahead = std::min(k + PREFETCHED, hits - 1);
    __builtin_prefetch(&target.pixels[std::size_t(cells.index[std::size_t(cells.hits[ahead])])]);
    const std::size_t i = std::size_t(cells.hits[k]);
    target.add(cells.index[i], cells.inverse_z[i], cells.source[i]);
  }
  for (std::size_t k = 0; k < others; ++k)
    renderOther(top, bottom, row, width, cells.others[k], cells, target);
}

} // namespace

WarpedView
warpView(const DepthView& view, const CameraIntrinsics& camera, const Pose& virtual_from_view,
         const VirtualDepthOptions& options)
{
  const int width = view.depth.cols, height = view.depth.rows;
  const std::size_t columns = std::size_t(width);
  const Warp warp(view.camera, camera, virtual_from_view);
  const DepthEdges linked(view.camera);
  WarpTarget target(camera, options);
  VertexRow top(columns), bottom(columns);
  RowCells cells(columns);
  for (int v = 0; v < height; ++v) {
    const float* z = view.depth.ptr<float>(v);
    simd::call<warpRow>(z, view.weight.ptr<float>(v), width, v, warp, bottom);
    simd::call<linkVertices>(z, z + 1, bottom.valid.data(), bottom.valid.data() + 1, width - 1,
                             linked, bottom.link_right.data());
    if (v > 0) {
      simd::call<linkVertices>(view.depth.ptr<float>(v - 1), z, top.valid.data(),
                               bottom.valid.data(), width, linked, top.link_down.data());
      simd::call<boundQuads>(top, bottom, width - 1, target, cells);
      simd::call<sampleQuads>(top, bottom, width - 1, v - 1, camera.width, cells);
      renderBetween(top, bottom, v - 1, width, cells, target);
    }
    std::swap(top, bottom);
  }
  return std::move(target.pixels);
}

} // namespace bundle_icp
