// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A folder of organized point clouds of PCL, one a frame.
#include "common/pinhole_fit.h"
#include "io/image_file.h"
#include "io/recordings/image_streams.h"
#include "io/recordings/pcd_file.h"
#include "io/recordings/recorded_poses.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <cmath>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

bool
isPcdName(const std::string& name)
{
  return fs::path(name).extension() == ".pcd" && name.front() != '.';
}

class CloudReader : public FrameReader {
public:
  ImagePair
  read(const RecordedFrame& frame) const override
  {
    const CloudImages images = imagesOf(readOrganizedPcd(frame.color_file));
    return {images.color, images.depth};
  }
};

/** The camera of the first cloud that shows one. */
void
fitCamera(Recording& recording)
{
  std::string reason;
  for (const RecordedFrame& frame : recording.frames) {
    try {
      const PinholeFit fit = fitPinhole(readOrganizedPcd(frame.color_file));
      if (!std::isfinite(fit.deviation))
        continue; // hardly a point
      if (const std::string fault = faultOf(fit); !fault.empty())
        throw UnsuitableImage(frame.color_file + ": " + fault);
      recording.intrinsics.emplace();
      recording.intrinsics->fx = fit.camera.fx;
      recording.intrinsics->fy = fit.camera.fy;
      recording.intrinsics->cx = fit.camera.cx;
      recording.intrinsics->cy = fit.camera.cy;
      recording.intrinsics_source =
          "the points of " + frame.color_file + ", " + shortText(fit.deviation, 2) + " px off";
      return;
    }
    catch (const UnsuitableImage&) {
      throw;
    }
    catch (const pcl::IOException& error) {
      if (reason.empty())
        reason = messageOf(error);
    }
  }
  if (!reason.empty())
    throw IOException(reason);
}

void
takeViewpoints(Recording& recording)
{
  for (const RecordedFrame& frame : recording.frames)
    takePose(
        frame.timestamp, frame.color_file, [&] { return readPcdViewpoint(frame.color_file); },
        recording);
  // PCL writes the identity where it knows none.
  if (std::all_of(
          recording.ground_truth.begin(), recording.ground_truth.end(),
          [](const TimedPose& pose) { return pose.world_from_camera.isApprox(Pose::Identity()); }))
    recording.ground_truth.clear();
  finishEstimatedPoses("its recorder", recording);
}

} // namespace

bool
isPcdFolder(const std::string& folder)
{
  const fs::directory_iterator entries(folder);
  return std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    return isPcdName(entry.path().filename().string());
  });
}

Recording
readPcdFolder(const std::string& folder, const DatasetOptions& options)
{
  Recording recording;
  recording.format = "PCL point clouds";
  recording.depth_scale = 1;
  recording.depth_scale_source = "the format (PCL: metres)";
  recording.reader = std::make_shared<CloudReader>();
  Stream clouds = listFiles(folder, isPcdName);
  placeInTime(clouds, recording);
  for (const StreamImage& cloud : clouds)
    recording.frames.push_back({cloud.number, cloud.timestamp, cloud.file, cloud.file});
  if (!options.intrinsics)
    fitCamera(recording);
  takeViewpoints(recording);
  return recording;
}

} // namespace bundle_icp
