// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// transforms.json of nerfstudio, which exporters of phone scanners write as well.
#include "io/recordings/image_streams.h"

#include "io/recordings/json_file.h"
#include "io/recordings/name_numbers.h"
#include "io/recordings/recorded_poses.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

std::string
transformsFile(const std::string& path)
{
  return fs::is_directory(path) ? (fs::path(path) / "transforms.json").string() : path;
}

/** An image that a frame names; some exporters leave out the extension. */
std::string
imageFile(const fs::path& folder, const std::string& name)
{
  const fs::path file = (folder / name).lexically_normal();
  for (const char* const extension : {"", ".png", ".jpg"})
    if (fs::is_regular_file(file.string() + extension))
      return file.string() + extension;
  return file.string();
}

/** Intrinsics in a frame, or in the file for all of them. */
CameraIntrinsics
cameraOf(const Json& json, const std::string& path)
{
  const std::string model = json.value("camera_model", "OPENCV");
  static const std::set<std::string> known{"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL",
                                           "RADIAL"};
  if (!known.count(model) || json.value("k4", 0.0) != 0 || json.value("is_fisheye", false))
    throw IOException(path + ": camera model " + model +
                      (known.count(model) ? " with k4 or as a fisheye" : "") +
                      " is unknown; pictures of a fisheye must be undistorted before");
  CameraIntrinsics camera;
  camera.fx = json.at("fl_x");
  camera.fy = json.value("fl_y", camera.fx);
  camera.cx = json.at("cx");
  camera.cy = json.at("cy");
  camera.width = sizeIn(json, "w", path);
  camera.height = sizeIn(json, "h", path);
  camera.k1 = json.value("k1", 0.0);
  camera.k2 = json.value("k2", 0.0);
  camera.k3 = json.value("k3", 0.0);
  camera.p1 = json.value("p1", 0.0);
  camera.p2 = json.value("p2", 0.0);
  return camera;
}

Pose
poseOfFrame(const Json& frame, const std::string& source)
{
  const auto rows = frame.at("transform_matrix").get<std::vector<std::vector<double>>>();
  const double scale = frame.value("applied_scale", 1.0);
  if (rows.size() < 3 || rows.size() > 4 ||
      std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.size() != 4; }))
    throw IOException(source + ": transform_matrix must have 3 or 4 rows of 4 numbers");
  if (!(scale > 0 && std::isfinite(scale)))
    throw IOException(source + ": applied_scale must be positive");
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (Eigen::Index row = 0; row < 3; ++row)
    matrix.row(row) = Eigen::Map<const Eigen::RowVector4d>(rows[std::size_t(row)].data());
  Pose pose = fromOpenGl(poseOf(matrix, source));
  pose.translation() /= scale; // to metres
  return pose;
}

struct JsonFrame {
  RecordedFrame images;
  const Json* json = nullptr;
};

void
sortByNames(std::vector<JsonFrame>& frames)
{
  std::vector<std::string> stems;
  stems.reserve(frames.size());
  for (const JsonFrame& frame : frames)
    stems.push_back(fs::path(frame.images.color_file).stem().string());
  const auto parts = distinguishingParts(stems);
  std::vector<std::size_t> order(frames.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&parts](std::size_t a, std::size_t b) {
    return comesBefore(parts[a], parts[b]);
  });
  std::vector<JsonFrame> sorted;
  sorted.reserve(frames.size());
  for (const std::size_t i : order)
    sorted.push_back(frames[i]);
  frames = std::move(sorted);
}

/** The frames whose images exist, in the order of the names of colour. */
std::vector<JsonFrame>
framesOf(const Json& json, const fs::path& folder, bool use_masks, Recording& recording)
{
  std::vector<JsonFrame> frames;
  bool have_depth = false;
  for (const Json& frame : json.at("frames")) {
    RecordedFrame images;
    images.color_file = imageFile(folder, frame.at("file_path").get<std::string>());
    if (!frame.contains("depth_file_path"))
      continue;
    have_depth = true;
    images.depth_file = imageFile(folder, frame["depth_file_path"].get<std::string>());
    if (use_masks && frame.contains("mask_path")) {
      images.mask_file = imageFile(folder, frame["mask_path"].get<std::string>());
      recording.mask_rule = "those that transforms.json names";
    }
    bool is_complete = true;
    for (const std::string& file : {images.color_file, images.depth_file})
      if (is_complete && !fs::is_regular_file(file)) {
        recording.skipped.push_back({file, "named in transforms.json but absent"});
        is_complete = false;
      }
    if (is_complete)
      frames.push_back({images, &frame});
  }
  if (!have_depth)
    throw IOException((folder / "transforms.json").string() +
                      ": no frame has a depth_file_path: without depth there is no scale");
  if (frames.empty())
    throw IOException((folder / "transforms.json").string() +
                      ": none of the images that it names exists");
  sortByNames(frames);
  return frames;
}

void
takeFrames(const std::vector<JsonFrame>& frames, const Json& json, const std::string& path,
           Recording& recording)
{
  const bool have_times = std::all_of(frames.begin(), frames.end(), [](const JsonFrame& frame) {
    return frame.json->contains("timestamp");
  });
  Json common = json; // holds for each frame that says nothing else
  common.erase("frames");
  std::vector<CameraIntrinsics> cameras;
  for (const JsonFrame& frame : frames) {
    RecordedFrame images = frame.images;
    images.id = recording.frames.size();
    images.timestamp =
        have_times ? frame.json->at("timestamp").get<double>() : double(images.id) / 30;
    Json merged = common;
    merged.update(*frame.json);
    if (merged.contains("fl_x"))
      cameras.push_back(cameraOf(merged, path));
    if (merged.contains("transform_matrix"))
      takePose(
          images.timestamp, images.color_file,
          [&] { return poseOfFrame(merged, images.color_file); }, recording);
    recording.frames.push_back(images);
  }
  recording.has_times = have_times;
  if (!cameras.empty())
    takeMedianCamera(cameras, path, recording);
}

} // namespace

bool
isNerfstudio(const std::string& path)
{
  const fs::path file = transformsFile(path);
  return file.extension() == ".json" && fs::is_regular_file(file) &&
         readBytes(file.string()).find("\"depth_file_path\"") != std::string::npos;
}

Recording
readNerfstudio(const std::string& path, const DatasetOptions& options)
{
  const std::string file = transformsFile(path);
  Recording recording;
  recording.format = "nerfstudio";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (nerfstudio)";
  withJson(file, [&](const Json& json) {
    const auto frames = framesOf(json, fs::path(file).parent_path(), options.use_masks, recording);
    takeFrames(frames, json, file, recording);
  });
  recording.findings.push_back({Severity::NOTE,
                                "pairing",
                                "colour and depth images are paired as " + file +
                                    " says: " + std::to_string(recording.frames.size()) + " frames",
                                {{"frames", double(recording.frames.size())}},
                                ""});
  if (recording.has_times)
    checkStamps(file, recording);
  else
    sayNoTimes(recording);
  finishEstimatedPoses("its recorder", recording);
  return recording;
}

} // namespace bundle_icp
