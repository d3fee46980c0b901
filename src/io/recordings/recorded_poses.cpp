// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/recorded_poses.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>

namespace bundle_icp {

std::vector<double>
readNumbers(const std::string& path, std::size_t count)
{
  std::vector<double> values;
  for (const TextLine& line : readTextLines(path))
    for (const double value : parseNumbers(line, path))
      values.push_back(value);
  if (values.size() != count)
    throw IOException(path + ": " + std::to_string(values.size()) + " numbers; expected " +
                      std::to_string(count));
  return values;
}

Pose
poseOf(const Eigen::Matrix4d& matrix, const std::string& source)
{
  // KinectFusion's rotations, printed with few digits, are only nearly orthonormal.
  if (!isRigid(matrix, 1e-2))
    throw IOException(source + ": the pose is not a rigid motion");
  return closestPose(matrix);
}

Pose
readPoseFile(const std::string& path)
{
  const std::vector<double> values = readNumbers(path, 16);
  return poseOf(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data()),
                path);
}

Pose
fromOpenGl(const Pose& world_from_camera)
{
  Pose result = world_from_camera;
  result.linear().rightCols<2>() *= -1;
  return result;
}

void
takeMedianCamera(const std::vector<CameraIntrinsics>& cameras, const std::string& source,
                 Recording& recording)
{
  const auto sorted = [&cameras](double CameraIntrinsics::*number) {
    std::vector<double> values;
    values.reserve(cameras.size());
    for (const CameraIntrinsics& camera : cameras)
      values.push_back(camera.*number);
    std::sort(values.begin(), values.end());
    return values;
  };
  recording.intrinsics = cameras.front();
  recording.intrinsics_source = source;
  for (const auto number :
       {&CameraIntrinsics::fx, &CameraIntrinsics::fy, &CameraIntrinsics::cx, &CameraIntrinsics::cy})
    (*recording.intrinsics).*number = sorted(number)[cameras.size() / 2];
  const std::vector<double> focal_lengths = sorted(&CameraIntrinsics::fx);
  const double spread =
      (focal_lengths.back() - focal_lengths.front()) / focal_lengths[cameras.size() / 2];
  if (spread == 0)
    return;
  const bool is_large = spread > 0.01;
  recording.findings.push_back(
      {is_large ? Severity::WARNING : Severity::NOTE,
       "intrinsics",
       "each frame has its own intrinsics; their focal lengths differ by " +
           shortText(100 * spread, 2) + " %, and the median serves for all",
       {{"focal_length_spread", spread}},
       is_large ? "record with a fixed focus" : ""});
}

void
takePose(double timestamp, const std::string& source, const std::function<Pose()>& read,
         Recording& recording)
{
  try {
    recording.ground_truth.push_back({timestamp, read()});
  }
  catch (const pcl::IOException& error) {
    recording.skipped.push_back({source, messageOf(error)});
  }
}

void
finishEstimatedPoses(const std::string& maker, Recording& recording)
{
  Trajectory& poses = recording.ground_truth;
  std::stable_sort(poses.begin(), poses.end(), [](const TimedPose& a, const TimedPose& b) {
    return a.timestamp < b.timestamp;
  });
  const auto have_same_time = [](const TimedPose& a, const TimedPose& b) {
    return a.timestamp == b.timestamp;
  };
  poses.erase(std::unique(poses.begin(), poses.end(), have_same_time), poses.end());
  recording.pose_maker = maker;
}

} // namespace bundle_icp
