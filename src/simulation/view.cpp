// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace simulation {
namespace {

constexpr int TILE_SIZE = 8;

/** Keeps the nearer of `nearest` and the ray's hit on `seen`. */
void
update(Hit& nearest, const SeenPrimitive& seen, const Eigen::Vector3d& ray)
{
  const Hit hit = intersect(*seen.primitive, seen.origin, seen.local_from_camera * ray);
  if (hit.face >= 0 && hit.depth < nearest.depth)
    nearest = {hit.depth, hit.face + seen.primitive->first_face};
}

} // namespace

View::View(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera)
: scene_(scene), camera_(camera), inverse_focal_x_(1 / camera.fx), inverse_focal_y_(1 / camera.fy),
  seen_of_primitive_(scene.primitives().size(), -1),
  tile_columns_((camera.width + TILE_SIZE - 1) / TILE_SIZE),
  tile_rows_((camera.height + TILE_SIZE - 1) / TILE_SIZE)
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
  seen.local_from_camera_f = seen.local_from_camera.cast<float>();
  seen.origin_f = seen.origin.cast<float>();
  seen.nearest = std::numeric_limits<double>::infinity();
  double farthest = 0;
  Eigen::AlignedBox2d bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d local(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const Eigen::Vector3d point =
        seen.local_from_camera.transpose() * (local.cwiseProduct(primitive.half) - seen.origin);
    seen.nearest = std::min(seen.nearest, point.z());
    farthest = std::max(farthest, point.z());
    if (point.z() > 0)
      bounds.extend(camera_.project(point));
  }
  if (primitive.shape == Shape::ROOM) {
    seen.nearest = 0; // looked at first: things may reach into walls
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
      return std::clamp(int(std::floor((pixel + 0.5) / TILE_SIZE)), 0, count - 1);
    };
    for (int y = tile(bounds.y, tile_rows_); y <= tile(bounds.y + bounds.height, tile_rows_); ++y)
      for (int x = tile(bounds.x, tile_columns_); x <= tile(bounds.x + bounds.width, tile_columns_);
           ++x)
        tiles_[std::size_t(y) * tile_columns_ + x].push_back(std::uint16_t(i));
  }
}

Hit
View::cast(int x, int y) const
{
  const Eigen::Vector3d ray = direction(x, y);
  Hit nearest;
  nearest.depth = std::numeric_limits<double>::infinity();
  const std::size_t tile = std::size_t(y / TILE_SIZE) * tile_columns_ + x / TILE_SIZE;
  for (const std::uint16_t index : tiles_[tile]) {
    if (seen_[index].nearest >= nearest.depth)
      break;
    update(nearest, seen_[index], ray);
  }
  return nearest;
}

Hit
View::cast(double u, double v, const FaceSet& faces) const
{
  const Eigen::Vector3d ray = direction(u, v);
  Hit nearest;
  nearest.depth = std::numeric_limits<double>::infinity();
  int last = -1;
  for (int i = 0; i < faces.count; ++i) {
    const int primitive = scene_.face(faces.face[i]).primitive;
    if (primitive != last)
      update(nearest, seenOf(faces.face[i]), ray);
    last = primitive;
  }
  return nearest;
}

Eigen::Vector3f
View::normal(double u, double v, const Hit& hit) const
{
  const SeenPrimitive& seen = seenOf(hit.face);
  const Eigen::Vector3d point =
      seen.origin + hit.depth * (seen.local_from_camera * direction(u, v));
  return seen.primitive->world_from_local.cast<float>() *
         surfaceNormal(*seen.primitive, hit.face - seen.primitive->first_face, point.cast<float>());
}

Eigen::Array4f
View::shade(double u, double v, const Hit& hit, float pixel_size) const
{
  const SeenPrimitive& seen = seenOf(hit.face);
  const Eigen::Matrix3f& rotation = seen.local_from_camera_f;
  const Eigen::Vector3f ray = rotation * direction(u, v).cast<float>();
  const float depth = float(hit.depth);
  const Eigen::Vector3f point = seen.origin_f + depth * ray;
  const Eigen::Vector3f normal =
      surfaceNormal(*seen.primitive, hit.face - seen.primitive->first_face, point);
  // The pixel's edges, moved along the ray into the tangential plane.
  const float cosine = std::min(normal.dot(ray), -0.02f * ray.norm());
  const auto edge = [&](int column, double inverse_focal) -> Eigen::Vector3f {
    const Eigen::Vector3f step = rotation.col(column) * (depth * pixel_size * float(inverse_focal));
    return step - ray * (normal.dot(step) / cosine);
  };
  return scene_.color(hit.face, point, normal, edge(0, inverse_focal_x_),
                      edge(1, inverse_focal_y_));
}

} // namespace simulation
} // namespace bundle_icp
