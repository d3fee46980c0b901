// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What ScanNet's exporters make of a .sens file: a folder each for colour, depth and poses.
#include "io/recordings/calibration_files.h"
#include "io/recordings/image_streams.h"
#include "io/recordings/recorded_poses.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** File of a matrix of 4x4; empty when there is none. The exporters use two places. */
std::string
matrixFile(const std::string& folder, const std::string& matrix, const std::string& camera)
{
  const std::string ending = "_" + camera + ".txt";
  const std::string names[] = {matrix + "/" + matrix + ending, matrix + "s" + ending,
                               "intrinsic/" + matrix + ending};
  for (const std::string& name : names)
    if (fs::exists(fs::path(folder) / name))
      return (fs::path(folder) / name).string();
  return {};
}

/** Depth is in the place of colour in all that ScanNet has published; it does not say which way its
 *  matrices map. */
void
refuseOtherPlace(const std::string& folder)
{
  for (const char* const camera : {"color", "depth"}) {
    const std::string path = matrixFile(folder, "extrinsic", camera);
    if (path.empty())
      continue;
    const Pose pose = readPoseFile(path);
    if (!pose.isApprox(Pose::Identity(), 1e-6))
      throw IOException(path + ": is not the identity: depth must be registered to colour "
                               "before");
  }
}

void
takeCameras(const std::string& folder, Recording& recording)
{
  const std::string color = matrixFile(folder, "intrinsic", "color"),
                    depth = matrixFile(folder, "intrinsic", "depth");
  recording.intrinsics = readCameraMatrix(color, 4);
  recording.intrinsics_source = color;
  refuseOtherPlace(folder);
  if (depth.empty())
    return;
  const CameraIntrinsics depth_camera = readCameraMatrix(depth, 4);
  const CameraIntrinsics& c = *recording.intrinsics;
  if (depth_camera.fx != c.fx || depth_camera.fy != c.fy || depth_camera.cx != c.cx ||
      depth_camera.cy != c.cy)
    recording.depth_camera = DepthCamera{depth_camera, Pose::Identity()};
}

void
takePoses(const fs::path& folder, Recording& recording)
{
  if (!fs::is_directory(folder))
    return;
  for (const RecordedFrame& frame : recording.frames) {
    const std::string path = (folder / fs::path(frame.color_file).stem()).string() + ".txt";
    if (fs::exists(path))
      takePose(
          frame.timestamp, path, [&path] { return readPoseFile(path); }, recording);
  }
  finishEstimatedPoses("BundleFusion", recording);
}

} // namespace

bool
isScanNetFolder(const std::string& folder)
{
  return fs::is_directory(fs::path(folder) / "color") &&
         fs::is_directory(fs::path(folder) / "depth") &&
         !matrixFile(folder, "intrinsic", "color").empty();
}

Recording
readScanNetFolder(const std::string& folder, const DatasetOptions& options)
{
  Recording recording;
  recording.format = "ScanNet";
  recording.depth_scale = 1000;
  recording.depth_scale_source = "the format (ScanNet)";
  pairImages(listImages((fs::path(folder) / "color").string()),
             listImages((fs::path(folder) / "depth").string()), options, folder, recording);
  takeCameras(folder, recording);
  takePoses(fs::path(folder) / "pose", recording);
  return recording;
}

} // namespace bundle_icp
