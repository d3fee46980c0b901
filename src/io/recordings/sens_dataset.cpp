// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// ScanNet's recordings in one file.
#include "io/recordings/image_streams.h"
#include "io/recordings/recorded_poses.h"
#include "io/recordings/sens_file.h"
#include "io/recordings/time_stamps.h"

#include <boost/filesystem.hpp>
#include <pcl/exceptions.h>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Reads the file a frame at a time. */
class SensReader : public FrameReader {
public:
  SensReader(std::string path, SensContent content)
  : path_(std::move(path)), content_(std::move(content))
  {
  }

  ImagePair
  read(const RecordedFrame& frame) const override
  {
    return readSensImages(path_, content_.header, content_.frames.at(frame.id), frame.color_file);
  }

private:
  std::string path_;
  SensContent content_;
};

void
sayIfCutOff(const SensContent& content, const std::string& path, Recording& recording)
{
  const std::size_t found = content.frames.size(), announced = content.header.num_frames;
  if (found < announced)
    recording.findings.push_back(
        {Severity::WARNING,
         "frames",
         path + " is cut off: it holds " + std::to_string(found) + " of " +
             std::to_string(announced) + " frames",
         {{"frames", double(found)}, {"frames_announced", double(announced)}},
         "copy the file again"});
}

void
takeCameras(const SensHeader& header, const std::string& path, Recording& recording)
{
  const CameraIntrinsics &color = header.color, &depth = header.depth;
  recording.intrinsics = color;
  recording.intrinsics_source = path;
  if (color.width != depth.width || color.height != depth.height || color.fx != depth.fx ||
      color.fy != depth.fy || color.cx != depth.cx || color.cy != depth.cy)
    recording.depth_camera = DepthCamera{depth, Pose::Identity()};
  recording.depth_scale = header.depth_scale;
  recording.depth_scale_source = path;
}

/** Stamps count microseconds, unless they say otherwise.
 *  \return seconds a unit; nothing when they are no times. */
std::optional<double>
findTimeUnit(const std::vector<SensFrame>& frames, const std::string& path, Recording& recording)
{
  std::vector<double> stamps;
  stamps.reserve(frames.size());
  for (const SensFrame& frame : frames)
    stamps.push_back(frame.stamp);
  const TimeUnit unit = timeUnitOf(stamps).value_or(TimeUnit{1e-6, "microseconds"});
  if (!faultOfStamps(stamps, true).empty()) {
    sayNoTimes(recording);
    return std::nullopt;
  }
  recording.findings.push_back({Severity::NOTE,
                                "time_stamps",
                                "the time stamps of " + path + " are in " + unit.name,
                                {},
                                ""});
  return unit.seconds;
}

void
takeFrames(const std::vector<SensFrame>& frames, const std::string& path, Recording& recording)
{
  const std::optional<double> unit = findTimeUnit(frames, path, recording);
  for (const SensFrame& sens : frames) {
    RecordedFrame frame;
    frame.id = recording.frames.size();
    frame.timestamp = unit ? sens.stamp * *unit : double(frame.id) / 30;
    frame.color_file = frame.depth_file = path + "/" + std::to_string(frame.id);
    takePose(
        frame.timestamp, frame.color_file,
        [&] { return poseOf(sens.world_from_camera, frame.color_file); }, recording);
    recording.frames.push_back(frame);
  }
  finishEstimatedPoses("BundleFusion", recording);
}

/** The one .sens file of a folder, or the path itself; empty when there is none. */
std::string
sensFile(const std::string& path)
{
  if (!fs::is_directory(path))
    return fs::path(path).extension() == ".sens" ? path : "";
  std::string found;
  for (const fs::directory_entry& entry : fs::directory_iterator(path))
    if (entry.path().extension() == ".sens") {
      if (!found.empty())
        return {};
      found = entry.path().string();
    }
  return found;
}

} // namespace

bool
isSens(const std::string& path)
{
  return !sensFile(path).empty();
}

Recording
readSens(const std::string& path, const DatasetOptions&)
{
  const std::string name = sensFile(path);
  SensContent content = readSensContent(name);
  Recording recording;
  recording.format = "ScanNet .sens";
  recording.other_files = {name};
  takeCameras(content.header, name, recording);
  sayIfCutOff(content, name, recording);
  takeFrames(content.frames, name, recording);
  recording.reader = std::make_shared<SensReader>(name, std::move(content));
  return recording;
}

} // namespace bundle_icp
