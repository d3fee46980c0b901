// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/live_key_frames.h"

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

/** Samples of a view along each side that tell what another view sees of it. */
constexpr int SAMPLES = 20;
/** Depth of one surface in two views differs by at most this share. */
constexpr double SAME_SURFACE = 0.04;
/** A view that shares less is no use. */
constexpr double LEAST_SHARE = 0.1;

} // namespace

void
update(const LiveMap& map, std::vector<LiveKeyFrame>& key_frames)
{
  for (std::size_t k = 0; k < key_frames.size(); ++k) {
    LiveKeyFrame& key = key_frames[k];
    if (k < map.key_frames.size()) {
      key.features = map.key_frames[k].features;
      key.view = map.key_frames[k].view;
      key.points = map.key_frames[k].points;
      key.is_mapped = map.key_frames[k].world_from_camera.has_value();
      if (key.is_mapped) {
        key.depth_from_color = map.key_frames[k].depth_from_color;
        key.world_from_depth =
            *map.key_frames[k].world_from_camera * key.depth_from_color.inverse();
      }
    }
    if (!key.is_mapped && key.reference)
      key.world_from_depth =
          *key_frames[*key.reference].world_from_depth * key.reference_from_depth;
  }
}

std::vector<Covisible>
findCovisible(const std::vector<LiveKeyFrame>& key_frames, const DepthView& view,
              const Pose& world_from_depth)
{
  std::vector<Eigen::Vector3d> points;
  for (int j = 0; j < SAMPLES; ++j)
    for (int i = 0; i < SAMPLES; ++i) {
      const int u = (2 * i + 1) * view.depth.cols / (2 * SAMPLES);
      const int v = (2 * j + 1) * view.depth.rows / (2 * SAMPLES);
      if (const float z = view.depth.at<float>(v, u); z > 0)
        points.push_back(world_from_depth * view.camera.unproject(u, v, z));
    }
  std::vector<Covisible> found;
  for (std::size_t k = 0; k < key_frames.size(); ++k) {
    if (!key_frames[k].world_from_depth)
      continue;
    const DepthView& other = *key_frames[k].view;
    const Pose camera_from_world = key_frames[k].world_from_depth->inverse();
    std::size_t seen = 0;
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector3d p = camera_from_world * point;
      if (!(p.z() > 0))
        continue;
      const Eigen::Vector2d pixel = other.camera.project(p);
      if (!other.camera.contains(pixel))
        continue;
      const float z =
          other.depth.at<float>(int(std::lround(pixel.y())), int(std::lround(pixel.x())));
      seen += std::abs(z - p.z()) < SAME_SURFACE * p.z();
    }
    const double share = double(seen) / double(std::max<std::size_t>(1, points.size()));
    if (share >= LEAST_SHARE)
      found.push_back({k, share});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Covisible& a, const Covisible& b) { return a.share > b.share; });
  return found;
}

} // namespace bundle_icp
