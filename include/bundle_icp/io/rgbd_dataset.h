// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/finding.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/pose_prior.h>
#include <bundle_icp/common/rgbd_frame.h>
#include <bundle_icp/io/trajectory.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Camera of depth images that have another size than the colour images, or are seen from another
 *  place. */
struct BUNDLE_ICP_EXPORT DepthCamera {
  /** Of the depth images as recorded, distortion included; size 0 = that of the images, fx 0 =
   *  unknown: depth images then show what the colour camera shows, in another size. */
  CameraIntrinsics intrinsics;
  /** Pose of the depth camera in the frame of the colour camera: x_color = T x_depth [m]. */
  Pose color_from_depth = Pose::Identity();
};

/** Where RGBDDataset::prior() comes from. */
struct BUNDLE_ICP_EXPORT PosePriorOptions {
  /** Poses of the colour camera, matched with frames by time; unset = those that the recording's
   *  device estimated. Measured truth is never a prior. */
  std::optional<Trajectory> trajectory;
  /** Where `trajectory` comes from, for messages. */
  std::string source = "the options";
  /** The deviations of all frames, see PosePrior. */
  double position_sigma = PosePrior().position_sigma;
  double rotation_sigma = PosePrior().rotation_sigma;

  bool
  isValid(std::string* error = nullptr) const;
};

/** How openDataset() reads a recording. */
struct BUNDLE_ICP_EXPORT DatasetOptions {
  /** Intrinsics of the recorded images, distortion included; unset = the format's. If width and
   *  height are 0, the size of the images counts. */
  std::optional<CameraIntrinsics> intrinsics;
  /** Where `intrinsics` come from, for messages. */
  std::string intrinsics_source = "the options";
  /** Horizontal field of view [rad] of a camera with square pixels and its axis in the middle of
   *  the image, which then stands for the recording's; unset = none is assumed. For
   *  estimateIntrinsics(). */
  std::optional<double> field_of_view;
  /** What is known of the recording beforehand; becomes a part of RGBDDataset::findings(). */
  std::vector<Finding> findings;
  /** Intrinsics of depth that is not registered to colour, see DepthCamera; unset = the format's.
   *  Depth is then moved into the colour camera, at the size of the colour images. */
  std::optional<CameraIntrinsics> depth_intrinsics;
  /** DepthCamera::color_from_depth; unset = the format's. */
  std::optional<Pose> color_from_depth;
  /** Noise of the depth images; unset = that of the intrinsics, which is the Kinect's by
   *  default. */
  std::optional<DepthNoise> depth_noise;
  /** Units of the depth images per metre; unset = the format's (TUM 5000, most others
   *  1000). */
  std::optional<double> depth_scale;
  /** Factor that multiplies all depth: true over measured length (Calibration::depth_scale). */
  double depth_factor = 1;
  /** Poses that steer the reconstruction where its own data are weak; unset = none. */
  std::optional<PosePriorOptions> pose_prior;
  /** Takes every n-th frame of the recording. */
  std::size_t stride = 1;
  /** Maximum number of frames after the stride; 0 = all. */
  std::size_t max_frames = 0;
  /** Seed of a random order of the frames; unset = their own order. Frames keep their time
   *  stamps. */
  std::optional<std::uint64_t> shuffle_seed;
  /** Largest time between the colour and the depth image of a frame (TUM layout), and between a
   *  frame and its prior pose [s]. */
  double max_time_difference = 0.02;
  /** True: the distortion is removed from depth as from colour. Right where the sensor's driver
   *  registered depth to the distorted colour image. Of a depth camera with intrinsics of its own
   *  the distortion is always removed. */
  bool undistort_depth = true;
  /** True: pixels that are 0 in the images of a folder `mask/` or `masks/` have no depth. */
  bool use_masks = true;

  bool
  isValid(std::string* error = nullptr) const;
};

/** A file of a recording that cannot be used, and the reason. */
struct SkippedFile {
  std::string file;
  std::string reason;
};

/** Frames of one camera, read one at a time. reconstruct() accepts any source of frames that has a
 *  subclass. Several threads may call all const methods at once. */
class BUNDLE_ICP_EXPORT RGBDDataset {
public:
  using Ptr = std::shared_ptr<RGBDDataset>;
  using ConstPtr = std::shared_ptr<const RGBDDataset>;

  virtual ~RGBDDataset() = default;

  /** Number of frames. */
  virtual std::size_t
  size() const = 0;

  /** Camera of the frames that read() returns, without distortion. */
  virtual const CameraIntrinsics&
  camera() const = 0;

  /** Number of frame `index` in the recording (RGBDFrame::id), known before the frame is read. */
  virtual std::size_t
  id(std::size_t index) const = 0;

  /** Time stamp of frame `index` [s], known before the frame is read. */
  virtual double
  timestamp(std::size_t index) const = 0;

  /** Name of frame `index` in messages, for example its colour file. */
  virtual std::string
  name(std::size_t index) const = 0;

  /** Recording that frame `index` belongs to: its path as it was given; empty in memory. */
  virtual std::string
  recording(std::size_t /*index*/) const
  {
    return {};
  }

  /** Reads frame `index`: colour and depth undistorted, depth in metres.
   *  \throws pcl::IOException naming the file and what is wrong with the file. */
  virtual RGBDFrame
  read(std::size_t index) const = 0;

  /** False when neighbouring indices and stamps do not mean neighbouring camera positions. */
  virtual bool
  isOrdered() const
  {
    return true;
  }

  /** False when the stamps are not times of the recording but follow from numbers of frames. */
  virtual bool
  hasTimes() const
  {
    return true;
  }

  /** Name of the format, for example "TUM RGB-D". */
  virtual std::string
  format() const
  {
    return "memory";
  }

  /** True poses; empty when the recording has none. */
  virtual Trajectory
  groundTruth() const
  {
    return {};
  }

  /** What is known beforehand of the pose of frame `index`, when colour was taken. */
  virtual std::optional<PosePrior>
  prior(std::size_t /*index*/) const
  {
    return std::nullopt;
  }

  /** What was assumed about the recording, and what of its lists contradicts itself. */
  virtual std::vector<Finding>
  findings() const
  {
    return {};
  }

  /** Files that the recording names, but that are absent, have no partner or hold no pose. */
  virtual std::vector<SkippedFile>
  skipped() const
  {
    return {};
  }
};

/** Opens a recording. The content of the folder tells its format; of several that fit the first
 *  counts:
 *  - TUM RGB-D: `rgb.txt`, `depth.txt`, optionally `groundtruth.txt`. Colour and depth are
 *    associated by time, greedily, closest first, as the benchmark's script does. A frame's id is
 *    the number of its line in `rgb.txt`. Without a calibration file, a folder name with
 *    freiburg1, freiburg2 or freiburg3 selects the benchmark's camera. One list `associations.txt`
 *    (`TIME IMAGE TIME IMAGE`) serves as well, for example of ICL-NUIM. A negative fy or a file
 *    `*.gt.freiburg` tells it: its true poses are mirrored to match the images.
 *  - 7-Scenes and 3DMatch: `frame-000000.color.{png,jpg}`, `.depth.png`, `.pose.txt`. Intrinsics
 *    come from `camera-intrinsics.txt` in the folder or its parent, else 7-Scenes' own camera (585
 *    px) serves; colour is then warped into the depth camera, to which the poses belong. Poses that
 *    are not rigid are left out and listed in skipped().
 *  - Stray Scanner: `rgb/` (the frames of rgb.mp4), `depth/`, `camera_matrix.csv`, `odometry.csv`,
 *    optionally `confidence/`. Depth of the lowest confidence is left out.
 *  - Polycam's raw data: `keyframes/` with `images/`, `depth/`, `cameras/`, or the corrected ones,
 *    optionally `confidence/`.
 *  - ScanNet as its exporters write it: `color/`, `depth/`, `pose/`, `intrinsic/`.
 *  - nerfstudio and Record3D: `transforms.json` with a depth_file_path for each frame. The path may
 *    be that of the file.
 *  - Open3D and Redwood: `color/` (`image/`, `rgb/`), `depth/`, paired by the numbers in their
 *    names, or by the text that differs.
 *  - Images in one folder: `color0000.png`, `depth0000.png` and the like, told apart by the words
 *    in their names.
 *  - PCL: organized clouds `*.pcd` in the frame of the camera, one a frame. Intrinsics follow from
 *    the points.
 *  - ScanNet: one file `*.sens`. The path may be that of the file.
 *
 *  Where the format does not say them, intrinsics, and where the file says them the units of depth
 *  and the camera of depth, come from a calibration file in the folder, whose forms
 *  docs/recordings.md lists. Depth images of floats hold metres in any format. Poses that a device
 *  or its software estimated are groundTruth() as well, and a note in findings() says so. Where the
 *  options ask for it they are a prior().
 *
 *  Depth images of another size than the colour images, but of the same aspect ratio, count as the
 *  same view where no DepthCamera is known. Depth is moved into the colour images, whose size the
 *  frames have: pixels between neighbouring depth pixels on one surface get the depth of that
 *  surface, pixels that the depth camera did not see and those at depth edges get none.
 *
 *  Beside the images of any format may lie a folder `mask/` or `masks/` with one image a frame, of
 *  the size of the colour image: what is 0 in it is left out of features, poses and surface. A mask
 *  has the name of the colour image (or of the depth image), or is paired as depth is: by time, or
 *  by number.
 *
 *  The options' intrinsics and depth scale have precedence. Intrinsics are never invented:
 *  openDataset() throws when neither options, file nor format give them. Depth of 0 or 65535 units
 *  is not measured. Without time stamps, frame n is taken at n / 30 s. Frames are read until one is
 *  good: a file that cannot be decoded does no harm here, but read() throws for its frame.
 *  \throws pcl::IOException naming folder or file and reason: folder missing or empty, format
 *  unknown (with what was looked for and a layout that would work), no overlap in time, depth of
 *  another aspect ratio whose camera is unknown, 8-bit depth, a colour image in place of depth, no
 *  readable frame, intrinsics unknown, a mask of another size, prior poses that are absent or
 *  fit no frame in time.
 *  \throws pcl::BadArgumentException for invalid options or impossible intrinsics. */
BUNDLE_ICP_EXPORT RGBDDataset::Ptr
openDataset(const std::string& path, const DatasetOptions& options = {});

} // namespace bundle_icp
