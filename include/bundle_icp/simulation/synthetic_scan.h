// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/depth_noise.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/io/rgbd_dataset.h>

#include <cstdint>
#include <memory>
#include <string>

namespace bundle_icp {

/** What a synthetic scan shows and which faults its camera has. With the defaults everything
 *  is exact. */
struct BUNDLE_ICP_EXPORT SyntheticScanOptions {
  std::size_t num_frames = 60;
  double frame_rate = 10;     ///< [Hz]; with a longer scan the path goes on, at the same speed
  int width = 640, height = 480;
  double focal_length = 525;  ///< true focal length [px]
  std::uint64_t seed = 0;     ///< of scene texture, path and noise

  // Faults of the camera, all off.
  double noise_factor = 0;    ///< times DepthNoise: depth noise that grows with distance squared
  DepthNoise noise;
  double quantisation = 0;    ///< disparity step: depth is rounded to steps of this x z^2 [1/m]; Kinect about 0.0028
  double hole_fraction = 0;   ///< share of pixels without depth, in patches, 0 to 1
  bool flying_pixels = false; ///< mixed depth at occlusion edges
  double color_noise = 0;     ///< standard deviation of the colour [grey levels of 255]
  double blur_fraction = 0;   ///< share of frames with motion blur, 0 to 1
  double exposure_change = 0; ///< relative amplitude of a slow change of brightness
  double depth_bias = 0;      ///< relative bias a metre: measured = z (1 + depth_bias z) [1/m]
  double focal_error = 0;     ///< relative error of the focal length that camera() reports
  double time_offset = 0;     ///< depth is taken this much later than colour [s]
  bool unordered = false;     ///< written in random order, without meaningful stamps

  /** All faults of a common structured-light camera at once ("full noise"). */
  static SyntheticScanOptions
  fullNoise();

  bool
  isValid(std::string* error = nullptr) const;
};

/** A textured room with furniture-like objects, seen along a hand-held path: a dataset whose
 *  poses and surface are exactly known. Frames are rendered on demand, by ray casting. */
class BUNDLE_ICP_EXPORT SyntheticScan : public RGBDDataset {
public:
  /** \throws pcl::BadArgumentException for invalid options. */
  explicit SyntheticScan(const SyntheticScanOptions& options = {});
  ~SyntheticScan() override;

  std::size_t
  size() const override;
  const CameraIntrinsics&
  camera() const override;
  std::size_t
  id(std::size_t index) const override;
  double
  timestamp(std::size_t index) const override;
  std::string
  name(std::size_t index) const override;
  RGBDFrame
  read(std::size_t index) const override;
  bool
  isOrdered() const override;
  std::string
  format() const override;
  Trajectory
  groundTruth() const override;

  /** True pose of frame `index` when its colour was taken. */
  Pose
  worldFromCamera(std::size_t index) const;

  /** True when the colour of frame `index` is motion blurred. */
  bool
  isBlurred(std::size_t index) const;

  /** Frame `index` without any fault. */
  RGBDFrame
  readExact(std::size_t index) const;

  /** Frame seen from any pose, without any fault. */
  RGBDFrame
  render(const Pose& world_from_camera) const;

  /** Unsigned distance [m] from a point of the world to the true surface. */
  double
  distanceToSurface(const Eigen::Vector3d& point) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/** Writes the scan as a TUM RGB-D folder: `rgb.txt`, `depth.txt`, `groundtruth.txt`, `intrinsics.txt`,
 *  and `surface.ply`, points of the true surface that the frames see.
 *  \throws pcl::IOException naming file and reason. */
BUNDLE_ICP_EXPORT void
writeSyntheticScan(const SyntheticScan& scan,
                   const std::string& folder,
                   const ProgressCallback& progress = {});

} // namespace bundle_icp
