// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Where the images of one frame lie. */
struct RecordedFrame {
  std::size_t id = 0;
  double timestamp = 0; ///< [s]
  std::string color_file, depth_file;
  std::string mask_file = {}; ///< empty = none
};

/** Result of a format's reader: everything about a recording except its pixels. */
struct Recording {
  std::string format;
  std::vector<RecordedFrame> frames;
  std::optional<CameraIntrinsics> intrinsics; ///< size 0 = that of the images
  std::string intrinsics_source;              ///< where they come from, for messages
  std::optional<DepthCamera> depth_camera;    ///< unset = depth lies in the colour camera's pixels
  double depth_scale = 1000;                  ///< units per metre
  std::string depth_scale_source;             ///< where that comes from, for messages
  bool is_ordered = true;                     ///< the stamps tell the order of the frames
  bool has_times = true;                      ///< the stamps are times of the recording
  bool is_seven_scenes = false; ///< made by the 7-Scenes camera unless intrinsics say otherwise
  Trajectory ground_truth;
  std::string
      mask_rule; ///< where masks come from, for messages; empty = there is no folder of them
  std::vector<SkippedFile> skipped;
  std::vector<Finding> findings;
  /** What is wrong with the calibration file, which is then not used; empty = nothing. */
  std::string calibration_fault;
};

/** Whether a folder is laid out in a format. */
bool
isTumFolder(const std::string& folder);
bool
isSevenScenesFolder(const std::string& folder);
bool
isOpen3dFolder(const std::string& folder);

/** Reads the lists, calibration and poses of a folder, but no image.
 *  \throws pcl::IOException naming folder or file and the reason. */
Recording
readTumFolder(const std::string& folder, const DatasetOptions& options);
Recording
readSevenScenesFolder(const std::string& folder);
Recording
readOpen3dFolder(const std::string& folder, const DatasetOptions& options);

/** A dataset over the frames of a recording whose images are files.
 *  \throws as openDataset(). */
RGBDDataset::Ptr
makeImageFileDataset(Recording recording, const std::string& folder, const DatasetOptions& options);

} // namespace bundle_icp
