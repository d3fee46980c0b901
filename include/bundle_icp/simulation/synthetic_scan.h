// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/depth_noise.h>
#include <bundle_icp/common/progress.h>
#include <bundle_icp/io/rgbd_dataset.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace bundle_icp {

/** Contents of a synthetic scan and faults of its camera. The defaults have no faults. Every fault
 *  depends only on the seed and the frame, not on the order of reading. */
struct BUNDLE_ICP_EXPORT SyntheticScanOptions {
  std::size_t num_frames = 60; ///< 1 to 1,000,000
  double frame_rate = 10;      ///< [Hz], 0.1 to 1000; a longer scan goes on along the path
  int width = 640;             ///< image width [px], 16 to 8192
  int height = 480;            ///< image height [px], 16 to 8192
  double focal_length = 525;   ///< true focal length [px]
  std::uint64_t seed = 0;      ///< seed of textures, path and faults
  double start_time = 0;       ///< start of the scan on the path [s], 0 to 1e6: 67 = at the walls
  double movement = 1;         ///< share of the path's translation, 0 to 1: 0 = turning on the spot
  double texture = 1; ///< contrast of surfaces, 0 to 1; 0 = one colour on each side of an object

  // A depth camera beside the colour camera; none when all are 0.
  /** Images of the depth camera [px], 16 to 8192; 0 = those of colour. */
  int depth_width = 0, depth_height = 0;
  /** Focal length of the depth camera [px]; 0 = that which shows as much from left to right as the
   *  colour camera. */
  double depth_focal_length = 0;
  /** Where the depth camera sits in the frame of the colour camera [m], within 1 m. */
  Eigen::Vector3d depth_offset = Eigen::Vector3d::Zero();

  // What moves; true poses and surface are those of the room, but for the turntable.
  bool gripper = false; ///< a robot's gripper, fixed to the camera, in the lower third of the image
  bool person = false;  ///< a person who walks around the table
  bool still = false;   ///< the camera stays where the path starts, as on a tripod
  /** Before a camera that stands still, things on a turntable turn by 30 degrees a second. True
   *  poses and surface are theirs: the world is fixed to the disc, its z axis is that of the
   *  turntable. */
  bool turntable = false;

  // Faults of the camera, all off.
  /** Depth noise as a multiple of `noise`, 0 to 100. Neighbouring pixels share half of its
   *  variance. Above 0, only depth from 0.4 to 5 m is measured. */
  double noise_factor = 0;
  DepthNoise noise;           ///< standard deviation by distance
  double quantisation = 0;    ///< depth comes in steps of quantisation z^2 [1/m], 0 to 0.1
  double hole_fraction = 0;   ///< share of pixels without depth, in patches, 0 to 0.95
  bool flying_pixels = false; ///< mixed depth at occlusion edges, two pixels wide
  double color_noise = 0;     ///< standard deviation [grey levels of 255], 0 to 128
  double blur_fraction = 0;   ///< probability that a frame has motion blur, 0 to 1
  double exposure_change = 0; ///< relative change of brightness, slow, 0 to 0.9
  double depth_bias = 0;      ///< measured = z (1 + depth_bias z) [1/m], -0.1 to 0.1
  double focal_error = 0;     ///< camera() reports focal_length (1 + focal_error), +-0.5
  double time_offset = 0;     ///< time from colour to depth [s], -1 to 1
  /** Rolling shutter of the colour camera: time from the first to the last row [s], -0.1 to 0.1;
   *  the stamp is that of the middle row. */
  double readout = 0;
  bool unordered = false; ///< random order; the stamps follow this order and tell nothing

  /** The faults of a common structured-light camera at once: noise_factor 1,
   *  quantisation 0.0028, hole_fraction 0.05, flying pixels, color_noise 2,
   *  blur_fraction 0.05, exposure_change 0.15. */
  static SyntheticScanOptions
  fullNoise();

  /** The camera that renders the images; its axis is in the middle of the image. */
  CameraIntrinsics
  trueCamera() const;

  /** The camera of depth, its axis in the middle of the image and parallel to that of colour; unset
   *  when depth is registered. */
  std::optional<DepthCamera>
  depthCamera() const;

  /** Checks every field against its bounds. */
  bool
  isValid(std::string* error = nullptr) const;
};

/** A dataset with exactly known poses and surface: a textured room of 4 x 5 x 3 m with furniture
 *  and objects, seen along a hand-held path. Frames are rendered on demand, by ray casting of
 *  analytic solids. World frame: z up, floor at z = 0, metres.
 *
 *  The path goes to and fro around a table at 0.1 to 0.4 m/s, with turns of 10 to 30 degrees a
 *  second. The camera looks at the table for 55 s, then outwards for one tour along the walls, then
 *  at the table again, and so on. */
class BUNDLE_ICP_EXPORT SyntheticScan : public RGBDDataset {
public:
  using SurfaceCloud = pcl::PointCloud<pcl::PointNormal>;

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

  /** Depth of frame `index` as the depth camera measures it, with its faults: CV_32FC1 [m], NaN
   *  where nothing is measured, of the size of SyntheticScanOptions::depthCamera(). That of read()
   *  when depth is registered; read() gives registered depth in any case. */
  cv::Mat
  readDepth(std::size_t index) const;

  /** SyntheticScanOptions::depthCamera(); the focal_error is that of colour alone. */
  std::optional<DepthCamera>
  depthCamera() const;

  /** True pose of frame `index` when its colour was taken. */
  Pose
  worldFromCamera(std::size_t index) const;

  /** True when the colour of frame `index` has motion blur. */
  bool
  isBlurred(std::size_t index) const;

  /** Frame `index` without any fault. */
  RGBDFrame
  readExact(std::size_t index) const;

  /** What of frame `index` belongs to the room: CV_8UC1, 0 where gripper or person are in its
   *  colour image or within two pixels of that, 255 elsewhere. */
  cv::Mat
  mask(std::size_t index) const;

  /** Frame rendered from any pose, without any fault. */
  RGBDFrame
  render(const Pose& world_from_camera) const;

  /** Unsigned distance [m] from a point of the world to the true surface. */
  double
  distanceToSurface(const Eigen::Vector3d& point) const;

  /** Points of the true surface that the frames see, with normals towards free space, about one
   *  point per voxel of edge `spacing` [m]. Only frames 0.1 s apart are used, which miss next to
   *  nothing.
   *
   *  \param[in] num_threads 0 = all; the result does not depend on it
   *  \throws pcl::BadArgumentException when spacing is below 1 mm or not finite. */
  SurfaceCloud::Ptr
  visibleSurface(double spacing = 0.005, int num_threads = 0) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/** Names of the formats that writeSyntheticScan() knows, with commas between them. */
BUNDLE_ICP_EXPORT std::string
syntheticScanFormats();

/** How writeSyntheticScan() works. */
struct BUNDLE_ICP_EXPORT SyntheticScanWriteOptions {
  /** Format of the recording: one of syntheticScanFormats(). openDataset() reads all of them. */
  std::string format = "tum";
  /** Spacing of the points in surface.ply [m], 0.001 to 1; 0 = no such file. */
  double surface_spacing = 0.005;
  bool masks = false;  ///< also `mask/`: SyntheticScan::mask() of each frame
  int num_threads = 0; ///< 0 = all

  bool
  isValid(std::string* error = nullptr) const;
};

/** Writes the scan as a TUM RGB-D folder: `rgb/`, `depth/` (16 bit, 5000 units per metre),
 *  `rgb.txt`, `depth.txt`, `groundtruth.txt` at the stamps of colour, `intrinsics.txt` (`fx fy cx
 *  cy`, then `depth_scale 5000`; where depth has a camera of its own also lines `depth_intrinsics`
 *  and `depth_to_color`), `surface.ply`, the visibleSurface(), and `mask/` where asked for. The
 *  lists are written last: a folder with lists is complete. Other formats hold what their recorders
 *  write, depth in millimetres; some of them have neither stamps nor poses, and some keep colour as
 *  JPEG. Not all can say that depth has a camera of its own.
 *
 *  \param[in] folder must be empty or not exist
 *  \throws pcl::IOException naming file and reason; existing files are not touched.
 *  \throws pcl::BadArgumentException for invalid options. */
BUNDLE_ICP_EXPORT void
writeSyntheticScan(const SyntheticScan& scan, const std::string& folder,
                   const SyntheticScanWriteOptions& options = {},
                   const ProgressCallback& progress = {});

} // namespace bundle_icp
