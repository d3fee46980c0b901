// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/depth_noise.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

namespace bundle_icp {

/** How a TSDFVolume is laid out and filled. */
struct BUNDLE_ICP_EXPORT TSDFOptions {
  double voxel_size = 0.005; ///< edge of a voxel [m]
  double truncation = 0.04;  ///< mu of equation (7) [m]; at least 2 voxels
  double min_depth = 0.1;    ///< nearer depth is not integrated [m]
  double max_depth = 5.0;    ///< farther depth is not integrated [m]
  /** Only inside this box of the world [m] are voxels allocated; unset = everywhere. */
  std::optional<Eigen::AlignedBox3d> region;
  DepthNoise noise;          ///< gives each measurement its weight
  int num_threads = 0;       ///< 0 = all

  bool
  isValid(std::string* error = nullptr) const;
};

/** Truncated signed distance function of equation (7) in sparse blocks of 8^3 voxels.
 *
 *  Each voxel keeps S_k(X_w), the weighted mean of the truncated distance (positive in front of
 *  the surface), its weight W_k(X_w), and a colour. World frame, metres; the centre of voxel
 *  (i, j, k) lies at voxel_size * (i, j, k). */
class BUNDLE_ICP_EXPORT TSDFVolume {
public:
  /** \throws pcl::BadArgumentException for invalid options. */
  explicit TSDFVolume(const TSDFOptions& options = {});
  ~TSDFVolume();
  TSDFVolume(TSDFVolume&&) noexcept;
  TSDFVolume&
  operator=(TSDFVolume&&) noexcept;

  /** Fuses one frame. The result does not depend on the number of threads.
   *  \throws pcl::BadArgumentException when image sizes differ from the camera's. */
  void
  integrate(const RGBDFrame& frame, const CameraIntrinsics& camera, const Pose& world_from_camera);

  const TSDFOptions&
  options() const;

  std::size_t
  numBlocks() const;

  std::size_t
  memoryBytes() const;

  /** Trilinear distance [m] at a point of the world, unset where it is unknown. */
  std::optional<float>
  distance(const Eigen::Vector3f& point) const;

  /** Implementation, shared with TSDFMarchingCubes. */
  struct Impl;
  const Impl&
  impl() const
  {
    return *impl_;
  }

private:
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
