// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/depth_registration.h"

#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {

namespace {

/** Nothing nearer to the colour camera is rendered [m]. */
constexpr float NEAR_PLANE = 0.05f;
/** Largest cell of the mesh, as a multiple of that of a surface seen from the same place: what is
 *  stretched more was seen by the depth camera at a grazing angle. */
constexpr double LARGEST_STRETCH = 8;
/** Smallest area of a triangle [px^2]: a sliver carries no depth; negative is seen from behind. */
constexpr float LEAST_AREA = 1e-4f;
/** Overlap of neighbouring triangles, as a share of their edges: closes the seams of rounding. */
constexpr float SEAM = 2e-3f;

/** A depth pixel in the colour image; inverse_z 0 [1/m] where there is none. */
struct Vertex {
  float u = 0, v = 0, inverse_z = 0;
};

Vertex
toVertex(const DepthRays& rays, std::size_t pixel, float z)
{
  const Eigen::Vector3f point = z * rays.rays[pixel] + rays.translation;
  if (!(z > 0 && point.z() > NEAR_PLANE)) // also where z or the ray is NaN
    return {};
  const float inverse = 1 / point.z();
  return {point.x() * inverse, point.y() * inverse, inverse};
}

/** Inverse depth [1/m] of the nearest surface at each pixel of the colour image, 0 = none. */
class InverseDepth {
public:
  InverseDepth(const cv::Size& size, float largest_cell)
  : pixels(size, CV_32FC1, cv::Scalar(0)), largest_cell_(largest_cell)
  {
  }

  /** Renders a triangle whose corners follow each other clockwise. */
  void
  draw(const Vertex& o, const Vertex& a, const Vertex& b)
  {
    if (!(o.inverse_z > 0 && a.inverse_z > 0 && b.inverse_z > 0))
      return;
    const float ax = a.u - o.u, ay = a.v - o.v, bx = b.u - o.u, by = b.v - o.v;
    const float area = ax * by - ay * bx;
    const float low_u = std::min({0.0f, ax, bx}), high_u = std::max({0.0f, ax, bx});
    const float low_v = std::min({0.0f, ay, by}), high_v = std::max({0.0f, ay, by});
    const float du = high_u - low_u, dv = high_v - low_v;
    if (!(area > LEAST_AREA && std::max(du, dv) <= largest_cell_))
      return;
    const int u0 = clamped(std::ceil(o.u + low_u - SEAM * du), pixels.cols);
    const int v0 = clamped(std::ceil(o.v + low_v - SEAM * dv), pixels.rows);
    const int u1 = clamped(std::floor(o.u + high_u + SEAM * du) + 1, pixels.cols);
    const int v1 = clamped(std::floor(o.v + high_v + SEAM * dv) + 1, pixels.rows);
    const float to_a = a.inverse_z - o.inverse_z, to_b = b.inverse_z - o.inverse_z;
    const float scale = 1 / area;
    for (int v = v0; v < v1; ++v) {
      float* const row = pixels.ptr<float>(v);
      const float y = float(v) - o.v;
      for (int u = u0; u < u1; ++u) { // without branches, for vector instructions
        const float x = float(u) - o.u;
        const float s = (x * by - y * bx) * scale, t = (ax * y - ay * x) * scale;
        const float inside = std::min(std::min(s, t), 1 - s - t);
        const float inverse_z = o.inverse_z + s * to_a + t * to_b;
        row[u] = std::max(row[u], inside >= -SEAM ? inverse_z : 0.0f);
      }
    }
  }

  cv::Mat pixels; ///< CV_32FC1

private:
  static int
  clamped(float coordinate, int size)
  {
    return int(std::min(std::max(coordinate, 0.0f), float(size)));
  }

  float largest_cell_;
};

/** Four neighbouring depth pixels: top left, top right, bottom right, bottom left. */
struct Quad {
  Vertex corner[4];
  bool linked[4]; ///< corner i and the next one lie on one surface

  bool
  isWhole() const
  {
    return linked[0] && linked[1] && linked[2] && linked[3];
  }
};

void
drawSurface(const Quad& quad, InverseDepth& surface)
{
  const Vertex* const c = quad.corner;
  if (!quad.isWhole()) {
    for (int i = 0; i < 4; ++i)
      if (quad.linked[i] && quad.linked[(i + 3) % 4])
        surface.draw(c[i], c[(i + 1) % 4], c[(i + 3) % 4]);
    return;
  }
  // Along the diagonal on which depth changes less, a fold stays a fold.
  const int i =
      std::abs(c[0].inverse_z - c[2].inverse_z) <= std::abs(c[1].inverse_z - c[3].inverse_z) ? 0
                                                                                             : 1;
  surface.draw(c[i], c[i + 1], c[i + 2]);
  surface.draw(c[i], c[i + 2], c[(i + 3) % 4]);
}

/** A row of the depth image in the colour image. */
struct VertexRow {
  std::vector<Vertex> vertices;
  std::vector<char> linked; ///< 1 = lies on one surface with the next of the row

  void
  project(const DepthRays& rays, const DepthEdges& edges, const cv::Mat& depth, int v)
  {
    const float* const z = depth.ptr<float>(v);
    const std::size_t width = std::size_t(depth.cols), first = std::size_t(v) * width;
    vertices.resize(width);
    linked.resize(width - 1);
    for (std::size_t u = 0; u < width; ++u)
      vertices[u] = toVertex(rays, first + u, z[u]);
    for (std::size_t u = 0; u + 1 < width; ++u)
      linked[u] = edges(z[u], z[u + 1]) > 0;
  }
};

/** What is seen between four pixels that lie on several surfaces may belong to the nearest of them
 *  and hide what lies behind it.
 *  \param pixel the first of the four */
void
drawCover(const DepthRays& rays, const cv::Mat& depth, std::size_t pixel, InverseDepth& cover)
{
  const std::size_t width = std::size_t(depth.cols);
  const std::size_t pixels[] = {pixel, pixel + 1, pixel + 1 + width, pixel + width};
  float nearest = std::numeric_limits<float>::infinity();
  for (const std::size_t i : pixels) {
    const float z = depth.at<float>(int(i / width), int(i % width));
    nearest = z < nearest ? z : nearest;
  }
  if (std::isinf(nearest))
    return;
  const auto corner = [&](std::size_t i) { return toVertex(rays, pixels[i], nearest); };
  const Vertex first = corner(0), opposite = corner(2);
  cover.draw(first, corner(1), opposite);
  cover.draw(first, opposite, corner(3));
}

/** Depth [m] of the surface where no cover is nearer than it, else NaN. */
cv::Mat
visibleDepth(const cv::Mat& inverse_surface, const cv::Mat& inverse_cover, const DepthEdges& edges)
{
  cv::Mat result(inverse_surface.size(), CV_32FC1);
  for (int v = 0; v < result.rows; ++v) {
    const float* const surface = inverse_surface.ptr<float>(v);
    const float* const cover = inverse_cover.ptr<float>(v);
    float* const out = result.ptr<float>(v);
    for (int u = 0; u < result.cols; ++u) {
      const float z = 1 / surface[u], covered = 1 / cover[u]; // infinite where there is none
      const bool is_hidden = z - covered > edges.tolerance(covered);
      out[u] = std::isinf(z) || is_hidden ? std::numeric_limits<float>::quiet_NaN() : z;
    }
  }
  return result;
}

/** Rays of all pixels, x and y at z = 1; NaN where the lens model cannot be inverted. */
std::vector<cv::Point2d>
raysOf(const CameraIntrinsics& camera)
{
  std::vector<cv::Point2d> pixels, rays;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      pixels.emplace_back(u, v);
      rays.emplace_back((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
    }
  if (!camera.hasDistortion())
    return rays;
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Matx<double, 1, 5> lens(camera.k1, camera.k2, camera.p1, camera.p2, camera.k3);
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-6);
  cv::undistortPoints(pixels, rays, matrix, lens, cv::noArray(), cv::noArray(), criteria);
  std::vector<cv::Point3d> points;
  for (const cv::Point2d& ray : rays)
    points.emplace_back(ray.x, ray.y, 1);
  std::vector<cv::Point2d> seen;
  cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix, lens, seen);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (!(cv::norm(seen[i] - pixels[i]) < 0.1)) // [px]; outside the lens's circle it diverges
      rays[i] = {nan, nan};
  return rays;
}

} // namespace

DepthRegistration::DepthRegistration(const DepthCamera& depth, const CameraIntrinsics& color)
: color_size_(color.width, color.height)
{
  CameraIntrinsics camera = depth.intrinsics;
  camera.depth_noise = color.depth_noise;
  edges_ = DepthEdges(camera);
  const double zoom = std::max({color.fx / camera.fx, color.fy / camera.fy, 1.0});
  largest_cell_ = float(LARGEST_STRETCH * zoom);
  Eigen::Matrix3d matrix;
  matrix << color.fx, 0, color.cx, 0, color.fy, color.cy, 0, 0, 1;
  const Eigen::Matrix3d color_from_ray = matrix * depth.color_from_depth.linear();
  rays_.translation = (matrix * depth.color_from_depth.translation()).cast<float>();
  for (const cv::Point2d& ray : raysOf(camera))
    rays_.rays.push_back((color_from_ray * Eigen::Vector3d(ray.x, ray.y, 1)).cast<float>());
}

cv::Mat
DepthRegistration::toColor(const cv::Mat& depth) const
{
  InverseDepth surface(color_size_, largest_cell_), cover(color_size_, largest_cell_);
  VertexRow above, row;
  above.project(rays_, edges_, depth, 0);
  for (int v = 1; v < depth.rows; ++v) {
    row.project(rays_, edges_, depth, v);
    const float *const top = depth.ptr<float>(v - 1), *const bottom = depth.ptr<float>(v);
    bool is_left_linked = edges_(top[0], bottom[0]) > 0;
    for (int u = 0; u + 1 < depth.cols; ++u) {
      const std::size_t i = std::size_t(u);
      const bool is_right_linked = edges_(top[u + 1], bottom[u + 1]) > 0;
      const Quad quad{
          {above.vertices[i], above.vertices[i + 1], row.vertices[i + 1], row.vertices[i]},
          {above.linked[i] != 0, is_right_linked, row.linked[i] != 0, is_left_linked}};
      drawSurface(quad, surface);
      if (!quad.isWhole())
        drawCover(rays_, depth, std::size_t(v - 1) * std::size_t(depth.cols) + i, cover);
      is_left_linked = is_right_linked;
    }
    std::swap(above, row);
  }
  return visibleDepth(surface.pixels, cover.pixels, edges_);
}

} // namespace bundle_icp
