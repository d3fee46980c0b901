// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/calibration_files.h"
#include "io/recordings/confidence.h"
#include "io/recordings/image_streams.h"
#include "io/recordings/recorded_poses.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <map>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Time and pose of a frame, as a line of odometry.csv has them. */
using Odometry = std::map<std::size_t, TimedPose>;

void
takeLine(const TextLine& line, const std::string& path, Odometry& odometry)
{
  const std::vector<double> v = parseNumbers(line, path);
  const std::string where = path + ":" + std::to_string(line.number);
  // Later versions of the recorder append the intrinsics of the frame.
  if (v.size() < 9 || v[1] < 0 || v[1] > 1e9)
    throw IOException(where + ": expected timestamp, frame, x, y, z, qx, qy, qz, qw");
  const Eigen::Quaterniond rotation(v[8], v[5], v[6], v[7]);
  if (std::abs(rotation.norm() - 1) > 1e-2)
    throw IOException(where + ": the quaternion is not of unit length");
  odometry[std::size_t(v[1])] = {v[0],
                                 Eigen::Translation3d(v[2], v[3], v[4]) * rotation.normalized()};
}

/** The lines that can be read; a damaged one costs its frame. */
Odometry
readOdometry(const std::string& path, Recording& recording)
{
  Odometry odometry;
  std::string fault;
  for (const TextLine& line : readTextLines(path)) {
    if (line.words[0] == "timestamp")
      continue;
    try {
      takeLine(line, path, odometry);
    }
    catch (const pcl::IOException& error) {
      fault = messageOf(error);
      recording.skipped.push_back({path, fault});
    }
  }
  if (odometry.empty() && !fault.empty())
    throw IOException(fault);
  return odometry;
}

/** Gives frames their stamps, and the recording its poses. */
void
takeOdometry(const std::string& path, Recording& recording)
{
  const Odometry odometry = readOdometry(path, recording);
  std::vector<RecordedFrame> frames;
  for (RecordedFrame& frame : recording.frames) {
    const auto found = odometry.find(frame.id);
    if (found == odometry.end()) {
      recording.skipped.push_back({frame.color_file, "has no line that can be read in " + path});
      continue;
    }
    frame.timestamp = found->second.timestamp;
    recording.ground_truth.push_back(found->second);
    frames.push_back(frame);
  }
  if (frames.empty())
    throw IOException(path + ": has a line for none of the images");
  constexpr double most_missing = 0.2;
  const auto missing = double(recording.frames.size() - frames.size());
  if (missing > most_missing * double(recording.frames.size()))
    recording.findings.push_back(
        {Severity::WARNING,
         "pairing",
         shortText(missing, 6) + " of " + std::to_string(recording.frames.size()) +
             " frames have no line that can be read in " + path + ": they are not used",
         {{"frames", missing}},
         "look whether the file is cut off"});
  recording.frames = std::move(frames);
  checkStamps(path, recording);
  finishEstimatedPoses("the device (ARKit)", recording);
}

/** A path as a shell takes it for one word. */
std::string
quotedForShell(const fs::path& path)
{
  std::string quoted = "'";
  for (const char c : path.string())
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

/** The recorder leaves a video, which is refused with the way to bring it to images. */
void
needFrames(const fs::path& place)
{
  const fs::path frames = place / "rgb", video = place / "rgb.mp4";
  if (fs::is_directory(frames) && !fs::is_empty(frames))
    return;
  if (!fs::exists(video))
    throw IOException(frames.string() + ": holds no images, and there is no rgb.mp4");
  throw IOException(
      video.string() + ": videos are not decoded; bring the frames to images with: mkdir -p " +
      quotedForShell(frames) + " && ffmpeg -i " + quotedForShell(video) +
      " -fps_mode passthrough -start_number 0 " + quotedForShell(frames / "%06d.png"));
}

} // namespace

bool
isStrayScannerFolder(const std::string& folder)
{
  const fs::path place(folder);
  return fs::exists(place / "odometry.csv") && fs::exists(place / "camera_matrix.csv") &&
         fs::is_directory(place / "depth");
}

Recording
readStrayScannerFolder(const std::string& folder, const DatasetOptions&)
{
  const fs::path place(folder);
  needFrames(place);
  Recording recording;
  recording.format = "Stray Scanner";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (Stray Scanner)";
  pairNumberedImages(listImages((place / "rgb").string()), listImages((place / "depth").string()),
                     folder, recording);
  takeOdometry((place / "odometry.csv").string(), recording);
  recording.intrinsics_source = (place / "camera_matrix.csv").string();
  recording.intrinsics = readCameraMatrix(recording.intrinsics_source, 3);
  useConfidence((place / "confidence").string(), recording);
  return recording;
}

} // namespace bundle_icp
