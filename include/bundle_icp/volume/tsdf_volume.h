// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/oriented_box.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/rgbd_frame.h>

#include <memory>
#include <optional>
#include <string>

namespace bundle_icp {

/** How a TSDFVolume is laid out and filled. */
struct BUNDLE_ICP_EXPORT TSDFOptions {
  /** Edge of a voxel [m], 0.0001 to 1. Half the edge takes about four times the memory. */
  double voxel_size = 0.005;
  /** mu of equation (7) [m], 2 to 100 voxels. Raise mu when noise or pose errors tear the surface;
   *  lower mu for thin objects seen from both sides. */
  double truncation = 0.04;
  double min_depth = 0.1; ///< nearer depth is not integrated [m]
  double max_depth = 5.0; ///< farther depth is not integrated [m]
  /** Box of the world [m], turned or an Eigen::AlignedBox3d, that limits the surface; unset = no
   *  limit. Voxels outside of the box are not filled, so the surface ends within a voxel of the
   *  box's faces. Only blocks of 8^3 voxels that reach into the box take memory. */
  std::optional<OrientedBox> region;
  /** Half size of the window that smooths depth images within surfaces before fusion [px], 0 to 10,
   *  rounded up to 2, 6 or 14; 0 = no smoothing. Far surfaces gain most. Steps below the noise of
   *  one image are lost, though all images together would show them. */
  int smoothing_radius = 6;
  int num_threads = 0; ///< 0 = all

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** Correction of a frame's colours. */
struct BUNDLE_ICP_EXPORT ColorCorrection {
  /** Factors of blue, green and red that undo the camera's choice of exposure and white balance,
   *  0.05 to 20; see estimateColorGains(). */
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();
  /** Weight of all colours of the frame, above 0 to 1; blurred frames get less. */
  float weight = 1;

  /** True when every field is in its range; otherwise `error` says which is not. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** Truncated signed distance function of equation (7) in sparse blocks of 8^3 voxels.
 *
 *  Each voxel keeps S_k(X_w), the weighted mean of the truncated distance, its weight W_k(X_w), and
 *  a colour with its own weight, in 8 bytes. World frame, metres; the centre of voxel (i, j, k)
 *  lies at voxel_size * (i, j, k). Distances are those of equation (7), along the optical axis,
 *  positive in front of the surface (on the camera's side). Depth and colour are interpolated
 *  between the pixels of one surface, not across depth edges.
 *
 *  A frontal measurement of the first frame's camera at 1 m has weight 1. Weights follow 1 /
 *  sigma(z)^2 of each frame's camera, the viewing angle and the distance to the depth edge. Colours
 *  within two pixels of a depth edge hardly count. Behind the surface a measurement counts in full
 *  as far as the grid and noise can displace it, by a voxel and sigma(z), and not at all four
 *  voxels farther, or beyond mu: the camera did not see what lies there, and must not outweigh
 *  cameras that saw free space. Blocks are allocated in the truncation band of each measurement;
 *  free space in front of the band is carved out of existing blocks only.
 *
 *   \code
 *   TSDFVolume volume(options);
 *   for (std::size_t i = 0; i < dataset.size(); ++i)
 *     volume.integrate(dataset.read(i), dataset.camera(), world_from_camera[i]);
 *   \endcode */
class BUNDLE_ICP_EXPORT TSDFVolume {
public:
  using Ptr = std::shared_ptr<TSDFVolume>;
  using ConstPtr = std::shared_ptr<const TSDFVolume>;

  /** \throws pcl::BadArgumentException for invalid options. */
  explicit TSDFVolume(const TSDFOptions& options = {});
  ~TSDFVolume();
  TSDFVolume(TSDFVolume&&) noexcept;
  TSDFVolume&
  operator=(TSDFVolume&&) noexcept;

  /** Fuses one frame; its colour may be empty. The result is the same, bit by bit, for any number
   *  of threads.
   *  \param correction of the frame's colours
   *  \throws pcl::BadArgumentException for image sizes or types that differ from the camera or
   *  RGBDFrame, impossible intrinsics, distortion, images smaller than 16x16, an invalid
   *  correction, or a pose that is not rigid or too far away to be addressed. The volume is then
   *  unchanged. */
  void
  integrate(const RGBDFrame& frame, const CameraIntrinsics& camera, const Pose& world_from_camera,
            const ColorCorrection& correction = {});

  const TSDFOptions&
  options() const;

  /** Number of allocated blocks of 8^3 voxels. */
  std::size_t
  numBlocks() const;

  /** Memory held by the voxels and their index [bytes]. */
  std::size_t
  memoryBytes() const;

  /** Trilinear distance [m] at a point of the world; unset where one of the eight voxels around the
   *  point has not been observed. */
  std::optional<float>
  distance(const Eigen::Vector3f& point) const;

  /** Implementation, shared with extractSurface(). */
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
