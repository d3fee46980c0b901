// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/parallel.h"

#include "volume/ray_range.h"
#include "volume/voxel_sampler.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/volume/tsdf_raycast.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

using Point = pcl::PointXYZRGBNormal;

/** Share of the stored distance that a ray may advance: distances are measured along
 * the axes of other cameras, and those of the nearest voxel are off by up to its
 * diagonal. */
constexpr float CAUTION = 0.7f;
/** A surface steeper than this to the ray is rarely one that a camera measured
 * (cosine). */
constexpr float MIN_COSINE = 0.05f;

/** A line through the volume, in voxels; depth along the camera's optical axis [m]. */
struct Ray {
  Eigen::Vector3f origin, direction;

  Eigen::Vector3f
  at(float depth) const
  {
    return origin + depth * direction;
  }
};

/** Depth at which the ray leaves the block that it is in. */
float
leaveBlock(const Ray& ray, float depth)
{
  // Voxel centres have integer coordinates: blocks reach from -0.5.
  const Eigen::Array3f position = ray.at(depth).array() + 0.5f;
  const Eigen::Array3f low = (position / BLOCK_EDGE).floor() * BLOCK_EDGE;
  float leave = std::numeric_limits<float>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const float direction = ray.direction[axis];
    const float wall = direction > 0 ? low[axis] + BLOCK_EDGE : low[axis];
    if (direction != 0)
      leave = std::min(leave, depth + (wall - position[axis]) / direction);
  }
  return leave;
}

class RayCaster {
public:
  RayCaster(const TSDFVolume::Impl& volume, const CameraIntrinsics& camera,
            const Pose& world_from_camera)
  : volume_(volume), camera_(camera), world_from_camera_(world_from_camera),
    ranges_(volume, camera, world_from_camera.inverse())
  {
  }

  void
  castRow(int y, VoxelSampler& sampler, Point* row) const
  {
    for (int x = 0; x < camera_.width; ++x)
      castPixel(x, y, sampler, row[x]);
  }

private:
  void
  castPixel(int x, int y, VoxelSampler& sampler, Point& point) const;
  std::optional<float>
  march(const Ray& ray, const RayRanges::Range& range, VoxelSampler& sampler) const;
  std::optional<float>
  refine(const Ray& ray, float front, float back, VoxelSampler& sampler) const;

  const TSDFVolume::Impl& volume_;
  const CameraIntrinsics& camera_;
  const Pose world_from_camera_;
  const RayRanges ranges_;
};

/** Advances from voxel to voxel, faster where the surface is far, until the distance
 * changes from in front to behind. */
std::optional<float>
RayCaster::march(const Ray& ray, const RayRanges::Range& range, VoxelSampler& sampler) const
{
  const float one_voxel = 1 / ray.direction.norm();
  const auto truncation = float(volume_.options.truncation);
  std::optional<float> front; // depth of the last sample, where that was in front
  for (float depth = range.near; depth <= range.far;) {
    const Eigen::Vector3f position = ray.at(depth);
    const Eigen::Vector3f shifted = position + Eigen::Vector3f::Constant(0.5f);
    const bool exists = sampler.block(shifted.array().floor().cast<int>()) != nullptr;
    const std::optional<float> distance = exists ? sampler.nearest(position) : std::nullopt;
    if (!distance) {
      front.reset();
      depth =
          exists ? depth + one_voxel : std::max(leaveBlock(ray, depth), depth) + 0.01f * one_voxel;
      continue;
    }
    if (*distance <= 0)
      return front ? refine(ray, *front, depth, sampler) : std::nullopt;
    front = depth;
    depth += std::max(one_voxel, CAUTION * *distance * truncation);
  }
  return std::nullopt;
}

/** The zero of the trilinear distance near a change of sign of the nearest voxels',
 * which may lie up to a voxel outside of it. */
std::optional<float>
RayCaster::refine(const Ray& ray, float front, float back, VoxelSampler& sampler) const
{
  constexpr int max_steps = 8;
  const float one_voxel = 1 / ray.direction.norm();
  std::optional<float> before = sampler.distance(ray.at(front));
  for (int i = 0; i < 2 && before && *before < 0; ++i)
    before = sampler.distance(ray.at(front -= one_voxel));
  std::optional<float> behind = sampler.distance(ray.at(back));
  for (int i = 0; i < 2 && behind && *behind > 0; ++i)
    behind = sampler.distance(ray.at(back += one_voxel));
  if (!before || !behind || *before < 0 || *behind > 0)
    return std::nullopt;
  float zero = front;
  for (int i = 0; i < max_steps && back - front > 0.01f * one_voxel; ++i) {
    zero = front + (back - front) * *before / std::max(*before - *behind, 1e-9f);
    const std::optional<float> distance = sampler.distance(ray.at(zero));
    if (!distance)
      return std::nullopt;
    if (std::abs(*distance) < 1e-3f)
      break;
    if (*distance > 0) {
      front = zero;
      before = distance;
    }
    else {
      back = zero;
      behind = distance;
    }
  }
  return zero;
}

void
RayCaster::castPixel(int x, int y, VoxelSampler& sampler, Point& point) const
{
  const float unseen = std::numeric_limits<float>::quiet_NaN();
  point.x = point.y = point.z = unseen;
  point.normal_x = point.normal_y = point.normal_z = unseen;
  const double per_voxel = 1 / volume_.options.voxel_size;
  const Eigen::Vector3d in_world = world_from_camera_.linear() * camera_.unproject(x, y, 1);
  const Ray ray{(per_voxel * world_from_camera_.translation()).cast<float>(),
                (per_voxel * in_world).cast<float>()};
  const std::optional<float> depth = march(ray, ranges_.at(x, y), sampler);
  if (!depth)
    return;
  const Eigen::Vector3f position = ray.at(*depth);
  const std::optional<Eigen::Vector3f> gradient = sampler.gradient(position);
  if (!gradient)
    return;
  const Eigen::Vector3f normal = gradient->normalized();
  if (!(-normal.dot(ray.direction.normalized()) > MIN_COSINE))
    return;
  point.getVector3fMap() = position * volume_.voxelSize();
  point.getNormalVector3fMap() = normal;
  const Eigen::Vector3f color = decodeColor(sampler.color(position));
  point.r = std::uint8_t(color.x());
  point.g = std::uint8_t(color.y());
  point.b = std::uint8_t(color.z());
}

} // namespace

pcl::PointCloud<pcl::PointXYZRGBNormal>::Ptr
raycast(const TSDFVolume& volume, const CameraIntrinsics& camera, const Pose& world_from_camera,
        int num_threads)
{
  std::string error;
  if (!camera.isValid(&error))
    throw BadArgumentException("raycast: " + error);
  if (camera.hasDistortion())
    throw BadArgumentException("raycast: the camera has distortion");
  if (!isRigid(world_from_camera.matrix()))
    throw BadArgumentException("raycast: world_from_camera is not a rigid motion");
  const auto width = std::uint32_t(camera.width);
  const auto height = std::uint32_t(camera.height);
  auto cloud = std::make_shared<pcl::PointCloud<Point>>(width, height);
  cloud->is_dense = false;
  const RayCaster caster(volume.impl(), camera, world_from_camera);
#pragma omp parallel num_threads(resolveThreads(num_threads))
  {
    VoxelSampler sampler(volume.impl());
#pragma omp for schedule(dynamic, 4)
    for (int y = 0; y < camera.height; ++y)
      caster.castRow(y, sampler, &(*cloud)(0, y));
  }
  return cloud;
}

} // namespace bundle_icp
