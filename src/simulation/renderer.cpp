// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace bundle_icp {
namespace simulation {
namespace {

constexpr int tile_size = 16;
/** Rays along each edge of a pixel in which faces meet. */
constexpr int edge_rays = 3;

/** A primitive as one view sees it. */
struct SeenPrimitive {
  const Primitive* primitive = nullptr;
  Eigen::Matrix3d local_from_camera; ///< rotation
  Eigen::Vector3d origin;            ///< camera centre in the primitive's frame
  double nearest = 0;                ///< lower bound of its depth [m]
  cv::Rect2d bounds;                 ///< of its image [px]
};

/** A view of the scene, its primitives sorted into tiles of the image. */
class View {
public:
  View(const Scene& scene, const CameraIntrinsics& camera,
       const Pose& world_from_camera);

  /** First surface along the ray through a pixel. `face` is the scene's. */
  Hit
  cast(double u, double v) const;

  /** Colour of a hit, seen through a part of a pixel of edge `pixel_size`. */
  Eigen::Array4f
  shade(double u, double v, const Hit& hit, float pixel_size) const;

  Eigen::Vector3f
  normal(double u, double v, const Hit& hit) const;

private:
  Eigen::Vector3d
  direction(double u, double v) const
  {
    return {(u - camera_.cx) * inverse_focal_x_, (v - camera_.cy) * inverse_focal_y_,
            1};
  }

  SeenPrimitive
  see(const Primitive& primitive, const Pose& world_from_camera) const;
  void
  fillTiles();

  const Scene& scene_;
  const CameraIntrinsics& camera_;
  double inverse_focal_x_, inverse_focal_y_;
  std::vector<SeenPrimitive> seen_; ///< nearest first, those in sight only
  std::vector<int> seen_of_primitive_;
  std::vector<std::vector<std::uint16_t>> tiles_;
  int tile_columns_, tile_rows_;
};

View::View(const Scene& scene, const CameraIntrinsics& camera,
           const Pose& world_from_camera)
    : scene_(scene), camera_(camera), inverse_focal_x_(1 / camera.fx),
      inverse_focal_y_(1 / camera.fy),
      seen_of_primitive_(scene.primitives().size(), -1),
      tile_columns_((camera.width + tile_size - 1) / tile_size),
      tile_rows_((camera.height + tile_size - 1) / tile_size)
{
  for (const Primitive& primitive : scene.primitives()) {
    const SeenPrimitive seen = see(primitive, world_from_camera);
    if (!seen.bounds.empty())
      seen_.push_back(seen);
  }
  std::stable_sort(seen_.begin(), seen_.end(),
                   [](const auto& a, const auto& b) { return a.nearest < b.nearest; });
  for (std::size_t i = 0; i < seen_.size(); ++i)
    seen_of_primitive_[seen_[i].primitive - scene.primitives().data()] = int(i);
  fillTiles();
}

SeenPrimitive
View::see(const Primitive& primitive, const Pose& world_from_camera) const
{
  const cv::Rect2d image(-0.5, -0.5, camera_.width, camera_.height);
  SeenPrimitive seen;
  seen.primitive = &primitive;
  const Eigen::Matrix3d local_from_world = primitive.world_from_local.transpose();
  seen.local_from_camera = local_from_world * world_from_camera.linear();
  seen.origin = local_from_world * (world_from_camera.translation() - primitive.center);
  seen.nearest = std::numeric_limits<double>::infinity();
  double farthest = 0;
  Eigen::AlignedBox2d bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d local(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1,
                                corner & 4 ? 1 : -1);
    const Eigen::Vector3d point = seen.local_from_camera.transpose() *
                                  (local.cwiseProduct(primitive.half) - seen.origin);
    seen.nearest = std::min(seen.nearest, point.z());
    farthest = std::max(farthest, point.z());
    if (point.z() > 0)
      bounds.extend(camera_.project(point));
  }
  if (primitive.shape == Shape::ROOM) {
    seen.nearest = std::numeric_limits<double>::max(); // behind everything in it
    seen.bounds = image;
  }
  else if (seen.nearest > 1e-3)
    seen.bounds = image & cv::Rect2d(bounds.min().x() - 1, bounds.min().y() - 1,
                                     bounds.sizes().x() + 2, bounds.sizes().y() + 2);
  else if (farthest > 0)
    seen.bounds = image; // it reaches behind the camera: its image has no simple bounds
  return seen;
}

void
View::fillTiles()
{
  tiles_.resize(std::size_t(tile_columns_) * tile_rows_);
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const cv::Rect2d& bounds = seen_[i].bounds;
    const auto tile = [](double pixel, int count) {
      return std::clamp(int(std::floor((pixel + 0.5) / tile_size)), 0, count - 1);
    };
    for (int y = tile(bounds.y, tile_rows_);
         y <= tile(bounds.y + bounds.height, tile_rows_); ++y)
      for (int x = tile(bounds.x, tile_columns_);
           x <= tile(bounds.x + bounds.width, tile_columns_); ++x)
        tiles_[std::size_t(y) * tile_columns_ + x].push_back(std::uint16_t(i));
  }
}

Hit
View::cast(double u, double v) const
{
  const int x = std::clamp(int(u + 0.5), 0, camera_.width - 1) / tile_size;
  const int y = std::clamp(int(v + 0.5), 0, camera_.height - 1) / tile_size;
  const Eigen::Vector3d ray = direction(u, v);
  Hit nearest;
  nearest.depth = std::numeric_limits<double>::infinity();
  for (const std::uint16_t index : tiles_[std::size_t(y) * tile_columns_ + x]) {
    const SeenPrimitive& seen = seen_[index];
    if (seen.nearest >= nearest.depth)
      break;
    const Hit hit =
        intersect(*seen.primitive, seen.origin, seen.local_from_camera * ray);
    if (hit.face >= 0 && hit.depth < nearest.depth)
      nearest = {hit.depth, hit.face + seen.primitive->first_face};
  }
  return nearest;
}

Eigen::Vector3f
View::normal(double u, double v, const Hit& hit) const
{
  const SeenPrimitive& seen =
      seen_[seen_of_primitive_[scene_.face(hit.face).primitive]];
  const Eigen::Vector3d point =
      seen.origin + hit.depth * (seen.local_from_camera * direction(u, v));
  return seen.primitive->world_from_local.cast<float>() *
         surfaceNormal(*seen.primitive, hit.face - seen.primitive->first_face,
                       point.cast<float>());
}

Eigen::Array4f
View::shade(double u, double v, const Hit& hit, float pixel_size) const
{
  const SeenPrimitive& seen =
      seen_[seen_of_primitive_[scene_.face(hit.face).primitive]];
  const Eigen::Matrix3f rotation = seen.local_from_camera.cast<float>();
  const Eigen::Vector3f ray = rotation * direction(u, v).cast<float>();
  const float depth = float(hit.depth);
  const Eigen::Vector3f point = seen.origin.cast<float>() + depth * ray;
  const Eigen::Vector3f normal =
      surfaceNormal(*seen.primitive, hit.face - seen.primitive->first_face, point);
  // The pixel's edges, moved along the ray into the tangential plane.
  const float cosine = std::min(normal.dot(ray), -0.02f * ray.norm());
  const auto edge = [&](int column, double inverse_focal) -> Eigen::Vector3f {
    const Eigen::Vector3f step =
        rotation.col(column) * (depth * pixel_size * float(inverse_focal));
    return step - ray * (normal.dot(step) / cosine);
  };
  return scene_.color(hit.face, point, normal, edge(0, inverse_focal_x_),
                      edge(1, inverse_focal_y_));
}

cv::Vec3b
toPixel(const Eigen::Array4f& color)
{
  return {cv::saturate_cast<uchar>(color[0]), cv::saturate_cast<uchar>(color[1]),
          cv::saturate_cast<uchar>(color[2])};
}

/** True when a neighbour of the pixel sees another face. */
bool
isEdge(const cv::Mat& face, int x, int y)
{
  const int center = face.at<int>(y, x);
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, face.rows - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, face.cols - 1); ++u)
      if (face.at<int>(v, u) != center)
        return true;
  return false;
}

Eigen::Array4f
edgeColor(const View& view, int x, int y)
{
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (int i = 0; i < edge_rays * edge_rays; ++i) {
    const double u = x + (i % edge_rays + 0.5) / edge_rays - 0.5;
    const double v = y + (i / edge_rays + 0.5) / edge_rays - 0.5;
    sum += view.shade(u, v, view.cast(u, v), 1.f / edge_rays);
  }
  return sum / float(edge_rays * edge_rays);
}

} // namespace

GeometryImage
renderGeometry(const Scene& scene, const CameraIntrinsics& camera,
               const Pose& world_from_camera)
{
  const View view(scene, camera, world_from_camera);
  GeometryImage image;
  image.depth.create(camera.height, camera.width, CV_32FC1);
  image.face.create(camera.height, camera.width, CV_32SC1);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit = view.cast(x, y);
      image.depth.at<float>(y, x) = float(hit.depth);
      image.face.at<int>(y, x) = hit.face;
    }
  return image;
}

cv::Mat
renderColor(const Scene& scene, const CameraIntrinsics& camera,
            const Pose& world_from_camera, const GeometryImage& geometry)
{
  const View view(scene, camera, world_from_camera);
  cv::Mat color(camera.height, camera.width, CV_8UC3);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit{geometry.depth.at<float>(y, x), geometry.face.at<int>(y, x)};
      color.at<cv::Vec3b>(y, x) =
          toPixel(isEdge(geometry.face, x, y) ? edgeColor(view, x, y)
                                              : view.shade(x, y, hit, 1));
    }
  return color;
}

cv::Mat
renderNormals(const Scene& scene, const CameraIntrinsics& camera,
              const Pose& world_from_camera, const GeometryImage& geometry)
{
  const View view(scene, camera, world_from_camera);
  cv::Mat normals(camera.height, camera.width, CV_32FC3);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Hit hit{geometry.depth.at<float>(y, x), geometry.face.at<int>(y, x)};
      const Eigen::Vector3f normal = view.normal(x, y, hit);
      normals.at<cv::Vec3f>(y, x) = {normal.x(), normal.y(), normal.z()};
    }
  return normals;
}

} // namespace simulation
} // namespace bundle_icp
