// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <memory>
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
  std::optional<PosePrior> prior = {};
};

/** Colour and depth of a frame as recorded. */
struct ImagePair {
  cv::Mat color, depth; ///< CV_8UC3 BGR; CV_16UC1 or CV_32FC1
};

/** Reads the images of frames that are not simply two image files. Several threads may call
 *  read() at once. */
class FrameReader {
public:
  virtual ~FrameReader() = default;

  /** \throws pcl::IOException naming the file and what is wrong with it. */
  virtual ImagePair
  read(const RecordedFrame& frame) const = 0;
};

/** Result of a format's reader: everything about a recording except its pixels. */
struct Recording {
  std::string path; ///< as it was given
  std::string format;
  std::vector<RecordedFrame> frames;
  std::optional<CameraIntrinsics> intrinsics; ///< size 0 = that of the images
  std::string intrinsics_source;              ///< where they come from, for messages
  std::optional<DepthCamera> depth_camera;    ///< unset = depth lies in the colour camera's pixels
  bool is_turned_down = false;    ///< fy counts without its sign, which says that y points upwards
  double depth_scale = 1000;      ///< units per metre
  std::string depth_scale_source; ///< where that comes from, for messages
  bool is_ordered = true;         ///< the stamps tell the order of the frames
  bool has_times = true;          ///< the stamps are times of the recording
  /** Made by the cameras of 7-Scenes, unless intrinsics or units say otherwise. */
  bool is_seven_scenes = false;
  Trajectory ground_truth;
  std::string pose_maker; ///< who estimated these poses; empty = they are measured truth
  std::shared_ptr<const FrameReader> reader; ///< unset = both images of a frame are files
  std::vector<std::string> other_files;      ///< belong to the frames besides images and masks
  std::string
      mask_rule; ///< where masks come from, for messages; empty = there is no folder of them
  std::vector<SkippedFile> skipped;
  std::vector<Finding> findings;
  /** What is wrong with the calibration file, which is then not used; empty = nothing. */
  std::string calibration_fault;
};

/** A way to lay out a recording. */
struct RecordingFormat {
  const char* name;
  const char* files; ///< what tells the format, for messages
  bool is_one_file;  ///< the path of the file serves as well as that of its folder
  bool (*fits)(const std::string& path);
  /** Reads lists, calibration and poses, but no image more than it takes to know them.
   *  \throws pcl::IOException naming folder or file and the reason. */
  Recording (*read)(const std::string& path, const DatasetOptions& options);
};

/** All formats; of several that fit a folder the first counts. */
const std::vector<RecordingFormat>&
recordingFormats();

// Each format has a file of its own.
bool
isTumFolder(const std::string& folder);
Recording
readTumFolder(const std::string& folder, const DatasetOptions& options);
bool
isSevenScenesFolder(const std::string& folder);
Recording
readSevenScenesFolder(const std::string& folder, const DatasetOptions& options);
bool
isOpen3dFolder(const std::string& folder);
Recording
readOpen3dFolder(const std::string& folder, const DatasetOptions& options);
bool
isOneFolder(const std::string& folder);
Recording
readOneFolder(const std::string& folder, const DatasetOptions& options);
bool
isStrayScannerFolder(const std::string& folder);
Recording
readStrayScannerFolder(const std::string& folder, const DatasetOptions& options);
bool
isNerfstudio(const std::string& path);
Recording
readNerfstudio(const std::string& path, const DatasetOptions& options);
bool
isPolycamFolder(const std::string& folder);
Recording
readPolycamFolder(const std::string& folder, const DatasetOptions& options);
bool
isScanNetFolder(const std::string& folder);
Recording
readScanNetFolder(const std::string& folder, const DatasetOptions& options);
bool
isPcdFolder(const std::string& folder);
Recording
readPcdFolder(const std::string& folder, const DatasetOptions& options);
bool
isSens(const std::string& path);
Recording
readSens(const std::string& path, const DatasetOptions& options);

/** A dataset over the frames of a recording.
 *  \throws as openDataset(). */
RGBDDataset::Ptr
makeImageFileDataset(Recording recording, const std::string& folder, const DatasetOptions& options);

} // namespace bundle_icp
