// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/rgbd_dataset.h>

#include "io/recordings/dataset_formats.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** The folder of a recording that may be one file. */
std::string
folderOf(const std::string& path)
{
  if (fs::is_directory(path))
    return path;
  const fs::path parent = fs::path(path).parent_path();
  return parent.empty() ? "." : parent.string();
}

/** What would have been read, and a layout that any recording can be brought to. */
std::string
howToLayOut(const std::string& folder)
{
  std::string text = "Looked for:\n";
  for (const RecordingFormat& format : recordingFormats())
    text += std::string("  ") + format.name + ": " + format.files + "\n";
  return text + "Any recording can be read in this layout:\n  " + folder +
         "/color/000000.png, 000001.png, ...\n  " + folder +
         "/depth/000000.png, 000001.png, ... (16 bit, millimetres)\n  " + folder +
         "/intrinsics.txt with the line: fx fy cx cy\n  bundle_icp_reconstruct " + folder +
         " -o result";
}

const RecordingFormat*
findFormat(const std::string& path)
{
  const bool is_folder = fs::is_directory(path);
  for (const RecordingFormat& format : recordingFormats())
    if ((is_folder || format.is_one_file) && format.fits(path))
      return &format;
  return nullptr;
}

/** Folders within that hold a recording; for messages. */
std::string
recordingsWithin(const std::string& folder)
{
  std::vector<std::string> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    try {
      if (fs::is_directory(entry.status()))
        if (const RecordingFormat* const format = findFormat(entry.path().string()))
          found.push_back(entry.path().string() + " (" + format->name + ")");
    }
    catch (const fs::filesystem_error&) {
      // A folder that may not be looked into is none that can be read.
    }
  std::sort(found.begin(), found.end());
  return found.empty() ? "" : ", but its folder " + found.front() + " may be a recording";
}

/** What to do with recordings that only their own software reads; for messages. */
std::string
recordingsOfOtherKinds(const std::string& folder)
{
  static const std::map<std::string, std::string> kinds = {
      {".bag", "a ROS or RealSense bag"}, {".db3", "a ROS 2 bag"},
      {".mcap", "a ROS 2 bag"},           {".mkv", "an Azure Kinect recording"},
      {".oni", "an OpenNI recording"},    {".klg", "a Kintinuous log"},
      {".r3d", "a Record3D recording"},   {".svo", "a ZED recording"},
  };
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (const auto kind = kinds.find(entry.path().extension().string()); kind != kinds.end())
      return "; " + entry.path().string() + " is " + kind->second +
             ", whose images must be exported before";
  return {};
}

Recording
readRecording(const std::string& path, const DatasetOptions& options)
{
  if (const RecordingFormat* const format = findFormat(path)) {
    Recording recording = format->read(path, options);
    recording.path = path;
    return recording;
  }
  if (!fs::is_directory(path))
    throw IOException(path +
                      ": is not a folder, and no recording in one file (x.sens, transforms.json)");
  throw IOException(path + ": unknown format" + recordingsWithin(path) +
                    recordingsOfOtherKinds(path) + ". " + howToLayOut(path));
}

void
checkPath(const std::string& path)
{
  boost::system::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status))
    throw IOException(path + ": " +
                      (status.type() == fs::file_not_found ? "no such folder"
                                                           : "cannot be read: " + code.message()));
  if (!fs::is_directory(status))
    return;
  const bool is_empty = fs::is_empty(path, code);
  if (code)
    throw IOException(path + ": cannot be read: " + code.message());
  if (is_empty)
    throw IOException(path + ": the folder is empty");
}

} // namespace

const std::vector<RecordingFormat>&
recordingFormats()
{
  // The most specific come first.
  static const std::vector<RecordingFormat> formats = {
      {"TUM RGB-D", "rgb.txt and depth.txt, or associations.txt", false, isTumFolder,
       readTumFolder},
      {"7-Scenes, 3DMatch", "frame-000000.color.png (or .jpg), frame-000000.depth.png", false,
       isSevenScenesFolder, readSevenScenesFolder},
      {"Stray Scanner", "rgb/, depth/, camera_matrix.csv, odometry.csv", false,
       isStrayScannerFolder, readStrayScannerFolder},
      {"Polycam's raw data", "keyframes/ with images/, depth/ and cameras/", false, isPolycamFolder,
       readPolycamFolder},
      {"ScanNet, exported", "color/, depth/, pose/, intrinsic/intrinsic_color.txt", false,
       isScanNetFolder, readScanNetFolder},
      {"nerfstudio, Record3D", "transforms.json with a depth_file_path for each frame", true,
       isNerfstudio, readNerfstudio},
      {"Open3D, Redwood", "color/ (image/, rgb/), depth/, intrinsic.json", false, isOpen3dFolder,
       readOpen3dFolder},
      {"images in one folder", "color0000.png, depth0000.png, intrinsics.txt", false, isOneFolder,
       readOneFolder},
      {"PCL", "organized clouds x.pcd, one a frame", false, isPcdFolder, readPcdFolder},
      {"ScanNet", "one file x.sens", true, isSens, readSens},
  };
  return formats;
}

bool
PosePriorOptions::isValid(std::string* error) const
{
  if (trajectory && trajectory->empty()) {
    if (error)
      *error = "pose prior: the trajectory is empty";
    return false;
  }
  for (const TimedPose& pose : trajectory.value_or(Trajectory()))
    if (!PosePrior{pose.world_from_camera, position_sigma, rotation_sigma}.isValid(error))
      return false;
  return PosePrior{Pose::Identity(), position_sigma, rotation_sigma}.isValid(error);
}

bool
DatasetOptions::isValid(std::string* error) const
{
  const auto fail = [error](const std::string& reason) {
    if (error)
      *error = reason;
    return false;
  };
  if (stride == 0)
    return fail("stride must be at least 1");
  if (depth_scale && !(std::isfinite(*depth_scale) && *depth_scale > 0))
    return fail("depth scale " + std::to_string(*depth_scale) +
                " units per metre must be finite and positive");
  if (!(depth_factor > 0.5 && depth_factor < 2))
    return fail("depth factor " + std::to_string(depth_factor) + " must lie in (0.5, 2)");
  if (field_of_view && !(*field_of_view > 0.1 && *field_of_view < 2.8))
    return fail("field of view " + std::to_string(*field_of_view) + " rad must lie in (0.1, 2.8)");
  if (depth_noise && !depth_noise->isValid(error))
    return false;
  if (color_from_depth && !isRigid(color_from_depth->matrix()))
    return fail("the pose of the depth camera must be a rigid motion");
  if (pose_prior && !pose_prior->isValid(error))
    return false;
  if (!(std::isfinite(max_time_difference) && max_time_difference > 0))
    return fail("largest time difference " + std::to_string(max_time_difference) +
                " s must be finite and positive");
  if (intrinsics && (intrinsics->width != 0 || intrinsics->height != 0))
    return intrinsics->isValid(error);
  return true;
}

RGBDDataset::Ptr
openDataset(const std::string& path, const DatasetOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("openDataset: " + error);
  try {
    checkPath(path);
    return makeImageFileDataset(readRecording(path, options), folderOf(path), options);
  }
  catch (const fs::filesystem_error& fault) {
    throw IOException(path + ": " + fault.what());
  }
  catch (const std::logic_error& fault) { // a size in a file is not what it must be
    throw IOException(path + ": is damaged: " + fault.what());
  }
}

} // namespace bundle_icp
