// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"
#include "io/recordings/image_streams.h"
#include "io/recordings/recorded_poses.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <array>
#include <map>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

// "frame-000012.color.png": 12 when the name has that form and the kind, else nothing.
std::optional<std::size_t>
frameNumber(const fs::path& file, const std::string& kind)
{
  const std::string name = file.filename().string(), start = "frame-";
  const std::size_t end = name.find("." + kind + ".");
  if (name.compare(0, start.size(), start) != 0 || end == std::string::npos)
    return std::nullopt;
  const std::string digits = name.substr(start.size(), end - start.size());
  if (digits.empty() || digits.size() > 18 ||
      digits.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  return std::stoull(digits);
}

void
collectFrames(const std::string& folder, Recording& recording)
{
  std::map<std::size_t, RecordedFrame> frames;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (const auto number = frameNumber(entry.path(), "color"))
      frames[*number].color_file = entry.path().string();
    else if (const auto depth_number = frameNumber(entry.path(), "depth"))
      frames[*depth_number].depth_file = entry.path().string();
  }
  for (auto& [number, frame] : frames) {
    frame.id = number;
    frame.timestamp = number / 30.0;
    if (frame.depth_file.empty())
      recording.skipped.push_back({frame.color_file, "has no depth image of its number"});
    else if (frame.color_file.empty())
      recording.skipped.push_back({frame.depth_file, "has no colour image of its number"});
    else
      recording.frames.push_back(frame);
  }
  if (recording.frames.empty())
    throw IOException(folder + ": no frame has both a colour and a depth image");
  recording.findings.push_back(
      {Severity::NOTE,
       "pairing",
       "colour and depth images are paired by the number in frame-NUMBER: " +
           std::to_string(recording.frames.size()) + " frames",
       {{"frames", double(recording.frames.size())}},
       ""});
  sayNoTimes(recording);
}

// 7-Scenes has a pose for each frame.
bool
hasAllPoses(const std::string& folder, const Recording& recording)
{
  return std::all_of(
      recording.frames.begin(), recording.frames.end(), [&folder](const RecordedFrame& frame) {
        const std::string name = fs::path(frame.color_file).filename().string();
        return fs::exists(fs::path(folder) / (name.substr(0, name.find('.')) + ".pose.txt"));
      });
}

// As 7-Scenes was published.
bool
isAllPng(const Recording& recording)
{
  return std::all_of(recording.frames.begin(), recording.frames.end(),
                     [](const RecordedFrame& frame) {
                       return fs::path(frame.color_file).extension() == ".png" &&
                              fs::path(frame.depth_file).extension() == ".png";
                     });
}

void
findCalibration(const std::string& folder, Recording& recording)
{
  if (readSensorInfo(folder, recording)) {
    recording.format = "ScanNet";
    return;
  }
  recording.is_seven_scenes = hasAllPoses(folder, recording);
  // 3DMatch keeps one file for all runs of a scene, in the folder above them.
  const fs::path absolute = fs::canonical(folder);
  for (const fs::path& place : {absolute, absolute.parent_path()}) {
    const fs::path file = place / "camera-intrinsics.txt";
    if (recording.intrinsics || !fs::exists(file))
      continue;
    recording.intrinsics = readCameraMatrix(file.string(), 3);
    recording.intrinsics_source = file.string();
  }
  if (!recording.intrinsics && !readCalibrationFile(folder, recording) &&
      recording.is_seven_scenes && isAllPng(recording)) {
    recording.intrinsics = parseIntrinsics("585,585,320,240");
    recording.intrinsics->width = 640;
    recording.intrinsics->height = 480;
    recording.intrinsics_source = "the format (7-Scenes)";
  }
}

void
readPoses(const std::string& folder, Recording& recording)
{
  for (const RecordedFrame& frame : recording.frames) {
    const std::string color = fs::path(frame.color_file).filename().string();
    const fs::path file = fs::path(folder) / (color.substr(0, color.find('.')) + ".pose.txt");
    if (!fs::exists(file))
      continue;
    takePose(
        frame.timestamp, file.string(), [&file] { return readPoseFile(file.string()); }, recording);
  }
}

} // namespace

bool
isSevenScenesFolder(const std::string& folder)
{
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (frameNumber(entry.path(), "color"))
      return true;
  return false;
}

Recording
readSevenScenesFolder(const std::string& folder, const DatasetOptions&)
{
  Recording recording;
  recording.format = "7-Scenes";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (7-Scenes)";
  collectFrames(folder, recording);
  findCalibration(folder, recording);
  readPoses(folder, recording);
  return recording;
}

} // namespace bundle_icp
