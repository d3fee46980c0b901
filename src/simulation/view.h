// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "simulation/scene.h"

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <array>
#include <cstdint>
#include <vector>

namespace bundle_icp {
namespace simulation {

/** A primitive as one view sees it. */
struct SeenPrimitive {
  const Primitive* primitive = nullptr;
  Eigen::Matrix3d local_from_camera;   ///< rotation
  Eigen::Vector3d origin;              ///< camera centre in the primitive's frame
  Eigen::Matrix3f local_from_camera_f; ///< the same in single precision
  Eigen::Vector3f origin_f;
  double nearest = 0; ///< lower bound of its depth [m]
  cv::Rect2d bounds;  ///< of its image [px]
};

/** A few different faces of the scene, in ascending order. */
struct FaceSet {
  int count = 0;
  std::array<int, 9> face;
};

/** A view of the scene, its primitives sorted into tiles of the image. Refers to scene
 * and camera, which must outlive it. */
class View {
public:
  View(const Scene& scene, const CameraIntrinsics& camera, const Pose& world_from_camera);

  /** First surface along the ray through the centre of a pixel. */
  Hit
  cast(int x, int y) const;

  /** First surface along any ray, among the primitives to which `faces` belong. */
  Hit
  cast(double u, double v, const FaceSet& faces) const;

  /** Colour of a hit, seen through a part of a pixel of edge `pixel_size`. */
  Eigen::Array4f
  shade(double u, double v, const Hit& hit, float pixel_size) const;

  /** Outward normal at a hit, in the world frame. */
  Eigen::Vector3f
  normal(double u, double v, const Hit& hit) const;

private:
  Eigen::Vector3d
  direction(double u, double v) const
  {
    return {(u - camera_.cx) * inverse_focal_x_, (v - camera_.cy) * inverse_focal_y_, 1};
  }

  const SeenPrimitive&
  seenOf(int face) const
  {
    return seen_[seen_of_primitive_[scene_.face(face).primitive]];
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
  std::vector<std::vector<std::uint16_t>> tiles_; ///< indices of seen_, nearest first
  int tile_columns_, tile_rows_;
};

} // namespace simulation
} // namespace bundle_icp
