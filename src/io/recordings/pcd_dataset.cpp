// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A folder of organized point clouds of PCL, one a frame.
#include "io/image_file.h"

#include "io/recordings/image_streams.h"
#include "io/recordings/pcd_file.h"
#include "io/recordings/recorded_poses.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <Eigen/Dense>
#include <boost/filesystem.hpp>
#include <opencv2/core.hpp>

namespace bundle_icp {

namespace fs = boost::filesystem;

namespace {

/** Largest deviation of points from the pixels of a pinhole camera [px]. */
constexpr double MAX_DEVIATION = 0.5;

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
    const OrganizedCloud cloud = readOrganizedPcd(frame.color_file);
    cv::Mat z;
    cv::extractChannel(cloud.xyz, z, 2);
    return {cloud.color, z};
  }
};

/** Focal length and centre along one axis that bring points to their pixels. */
struct Axis {
  double focal_length = 0, centre = 0, deviation = 0;
};

Axis
fitAxis(const OrganizedCloud& cloud, int axis)
{
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double squares = 0, count = 0;
  for (int v = 0; v < cloud.xyz.rows; ++v)
    for (int u = 0; u < cloud.xyz.cols; ++u) {
      const cv::Vec3f& point = cloud.xyz.at<cv::Vec3f>(v, u);
      const double slope = double(point[axis]) / double(point[2]), pixel = axis == 0 ? u : v;
      if (!(point[2] > 0) || !std::isfinite(slope))
        continue;
      const Eigen::Vector2d row(slope, 1);
      normal += row * row.transpose();
      right += row * pixel;
      squares += pixel * pixel;
      ++count;
    }
  if (count < 100 || std::abs(normal.determinant()) < 1e-9 * count * count)
    return {0, 0, std::numeric_limits<double>::infinity()};
  const Eigen::Vector2d solution = normal.ldlt().solve(right);
  const double residual = squares - solution.dot(right);
  return {solution.x(), solution.y(), std::sqrt(std::max(0., residual) / count)};
}

/** The camera of the first cloud that shows one. */
void
fitCamera(Recording& recording)
{
  std::string reason;
  for (const RecordedFrame& frame : recording.frames) {
    try {
      const OrganizedCloud cloud = readOrganizedPcd(frame.color_file);
      const Axis x = fitAxis(cloud, 0), y = fitAxis(cloud, 1);
      const double deviation = std::max(x.deviation, y.deviation);
      if (!std::isfinite(deviation))
        continue; // hardly a point
      if (deviation > MAX_DEVIATION || x.focal_length <= 0 || y.focal_length <= 0)
        throw UnsuitableImage(frame.color_file +
                              ": the points are not those of a camera that looks along z, x "
                              "right and y down: the pinhole camera that fits best has fx " +
                              shortText(x.focal_length, 4) + " px, fy " +
                              shortText(y.focal_length, 4) + " px, and misses the pixels by " +
                              shortText(deviation, 3) +
                              " px; clouds must be in the frame of the camera");
      recording.intrinsics.emplace();
      recording.intrinsics->fx = x.focal_length;
      recording.intrinsics->fy = y.focal_length;
      recording.intrinsics->cx = x.centre;
      recording.intrinsics->cy = y.centre;
      recording.intrinsics_source =
          "the points of " + frame.color_file + ", " + shortText(deviation, 2) + " px off";
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
