// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// The raw data that Polycam exports.
#include "io/recordings/confidence.h"
#include "io/recordings/image_streams.h"
#include "io/recordings/json_file.h"
#include "io/recordings/recorded_poses.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

fs::path
keyframes(const std::string& folder)
{
  return fs::is_directory(fs::path(folder) / "keyframes") ? fs::path(folder) / "keyframes"
                                                          : fs::path(folder);
}

/** Cameras are corrected where Polycam has optimised them, and with them the images. */
bool
areCorrected(const fs::path& place)
{
  return fs::is_directory(place / "corrected_images") &&
         fs::is_directory(place / "corrected_cameras");
}

fs::path
imagesIn(const fs::path& place)
{
  return place / (areCorrected(place) ? "corrected_images" : "images");
}

fs::path
camerasIn(const fs::path& place)
{
  return place / (areCorrected(place) ? "corrected_cameras" : "cameras");
}

CameraIntrinsics
cameraOf(const Json& json, const std::string& path)
{
  CameraIntrinsics camera;
  camera.fx = json.at("fx");
  camera.fy = json.at("fy");
  camera.cx = json.at("cx");
  camera.cy = json.at("cy");
  camera.width = sizeIn(json, "width", path);
  camera.height = sizeIn(json, "height", path);
  return camera;
}

Pose
poseIn(const Json& json, const std::string& path)
{
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      matrix(row, column) = json.at("t_" + std::to_string(row) + std::to_string(column));
  return fromOpenGl(poseOf(matrix, path));
}

void
takeCameras(const fs::path& folder, Recording& recording)
{
  std::vector<CameraIntrinsics> cameras;
  for (const RecordedFrame& frame : recording.frames) {
    const std::string path = (folder / fs::path(frame.color_file).stem()).string() + ".json";
    if (!fs::exists(path)) {
      recording.skipped.push_back({path, "absent: the frame has no pose"});
      continue;
    }
    try {
      withJson(path, [&](const Json& json) {
        cameras.push_back(cameraOf(json, path));
        takePose(
            frame.timestamp, path, [&] { return poseIn(json, path); }, recording);
      });
    }
    catch (const pcl::IOException& error) { // one of hundreds may be cut off
      recording.skipped.push_back({path, messageOf(error)});
    }
  }
  if (!cameras.empty())
    takeMedianCamera(cameras, folder.string(), recording);
}

} // namespace

bool
isPolycamFolder(const std::string& folder)
{
  const fs::path place = keyframes(folder);
  return fs::is_directory(imagesIn(place)) && fs::is_directory(place / "depth") &&
         fs::is_directory(camerasIn(place));
}

Recording
readPolycamFolder(const std::string& folder, const DatasetOptions& options)
{
  const fs::path place = keyframes(folder);
  Recording recording;
  recording.format = "Polycam";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (Polycam)";
  pairImages(listImages(imagesIn(place).string()), listImages((place / "depth").string()), options,
             folder, recording);
  takeCameras(camerasIn(place), recording);
  finishEstimatedPoses("the device (ARKit)", recording);
  useConfidence((place / "confidence").string(), recording);
  return recording;
}

} // namespace bundle_icp
