// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/rgbd_frame.h>
#include <bundle_icp/io/trajectory.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** How openDataset() reads a recording. */
struct BUNDLE_ICP_EXPORT DatasetOptions {
  /** Intrinsics of the recorded images, distortion included, instead of those of the
   * format; width and height may be 0: then those of the images. */
  std::optional<CameraIntrinsics> intrinsics;
  /** Of the depth images, instead of that of the intrinsics, which unless set is the Kinect's. */
  std::optional<DepthNoise> depth_noise;
  /** Units of the depth images per metre, instead of that of the format (TUM 5000,
   * 7-Scenes and Open3D 1000). */
  std::optional<double> depth_scale;
  /** Depth is multiplied by this: true over measured length (Calibration::depth_scale). */
  double depth_factor = 1;
  /** Takes every n-th frame, counted over the frames that the recording has. */
  std::size_t stride = 1;
  /** At most so many frames (after the stride); 0 = all. */
  std::size_t max_frames = 0;
  /** Gives the frames in a random order drawn from this seed. They keep their stamps. */
  std::optional<std::uint64_t> shuffle_seed;
  /** Largest time between a colour and a depth image of one frame [s] (TUM layout). */
  double max_time_difference = 0.02;
  /** Removes the distortion from depth as from colour, as is right where the sensor's
   * driver registered depth to the distorted colour image. */
  bool undistort_depth = true;

  bool
  isValid(std::string* error = nullptr) const;
};

/** A file that a recording names or has, but that cannot be used, and why. */
struct SkippedFile {
  std::string file;
  std::string reason;
};

/** Frames of one camera, read one at a time. A subclass makes any source of frames
 * usable by reconstruct(). All const methods may be called from several threads at
 * once. */
class BUNDLE_ICP_EXPORT RGBDDataset {
public:
  using Ptr = std::shared_ptr<RGBDDataset>;
  using ConstPtr = std::shared_ptr<const RGBDDataset>;

  virtual ~RGBDDataset() = default;

  /** Number of frames. */
  virtual std::size_t
  size() const = 0;

  /** Camera of the frames that read() gives: without distortion. */
  virtual const CameraIntrinsics&
  camera() const = 0;

  /** Number of frame `index` in the recording (RGBDFrame::id), known without reading
   * it. */
  virtual std::size_t
  id(std::size_t index) const = 0;

  /** Time stamp of frame `index` [s], known without reading it. */
  virtual double
  timestamp(std::size_t index) const = 0;

  /** What frame `index` is called in messages: its colour file, for example. */
  virtual std::string
  name(std::size_t index) const = 0;

  /** Reads frame `index`: colour and depth undistorted, depth in metres.
   *  \throws pcl::IOException naming the file and what is wrong with it. */
  virtual RGBDFrame
  read(std::size_t index) const = 0;

  /** False when neighbouring indices and stamps say nothing about neighbouring views.
   */
  virtual bool
  isOrdered() const
  {
    return true;
  }

  /** Name of the format, for example "TUM RGB-D". */
  virtual std::string
  format() const
  {
    return "memory";
  }

  /** True poses, when the recording has them; empty otherwise. */
  virtual Trajectory
  groundTruth() const
  {
    return {};
  }

  /** Files that the recording names but that are absent, found no partner or hold no
   * pose. */
  virtual std::vector<SkippedFile>
  skipped() const
  {
    return {};
  }
};

/** Opens a recording and recognises its format from the folder:
 *  - TUM RGB-D: `rgb.txt`, `depth.txt`, optionally `groundtruth.txt`. Colour and depth
 * are associated by time, greedily, closest first, as the benchmark's script does; a
 * frame's id is the number of its line in `rgb.txt`. Intrinsics from `intrinsics.txt`
 * (a line `fx fy cx cy [k1 k2 p1 p2 k3]`, optionally a line `depth_scale
 * UNITS_PER_METRE`), else those of the benchmark's cameras for folders with freiburg1,
 * freiburg2 or freiburg3 in the name.
 *  - 7-Scenes and 3DMatch: `frame-000000.color.{png,jpg}`, `.depth.png`, `.pose.txt`;
 * intrinsics from `camera-intrinsics.txt` in the folder or the one above, else those of
 * 7-Scenes. With the latter's camera (585 px), colour is warped into the depth camera,
 * to which the poses belong. Poses that are not rigid are left out, and listed in
 * skipped().
 *  - Open3D and Redwood: `color/` (`image/`, `rgb/`), `depth/`, paired by the numbers
 * in their names, or by order where these do not tell them apart; `intrinsic.json`
 * (`camera_intrinsic.json`), column-major, as Open3D writes it.
 *
 *  The options' intrinsics and depth scale have precedence. Intrinsics are never
 * invented: when neither options, file nor format give them, this throws. Depth of 0 or
 * 65535 units is not measured. Without time stamps, frame n is taken at n / 30 s.
 * Frames are read until one is good: files that cannot be decoded do no harm here, and
 * make read() throw for their frame. \throws pcl::IOException naming folder or file and
 * reason: folder missing or empty, format unknown, no overlap in time, sizes that
 * differ, 8-bit depth, a colour image in place of depth, no readable frame, intrinsics
 * unknown. \throws pcl::BadArgumentException for invalid options or impossible
 * intrinsics. */
BUNDLE_ICP_EXPORT RGBDDataset::Ptr
openDataset(const std::string& path, const DatasetOptions& options = {});

} // namespace bundle_icp
