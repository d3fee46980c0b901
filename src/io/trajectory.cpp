// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/atomic_file.h>

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/trajectory.h>

#include "io/text_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <locale>
#include <map>

namespace bundle_icp {

namespace {

TimedPose
parsePose(const TextLine& line, const std::string& path)
{
  const std::string where = path + ":" + std::to_string(line.number) + ": ";
  if (line.words.size() != 8)
    throw IOException(where + std::to_string(line.words.size()) +
                      " words; expected 8: timestamp tx ty tz qx qy qz qw");
  const std::vector<double> v = parseNumbers(line, path);
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (std::abs(rotation.norm() - 1) > 1e-2)
    throw IOException(where + "the quaternion has length " + std::to_string(rotation.norm()) +
                      "; expected 1");
  TimedPose pose;
  pose.timestamp = v[0];
  pose.world_from_camera.linear() = rotation.normalized().toRotationMatrix();
  pose.world_from_camera.translation() << v[1], v[2], v[3];
  return pose;
}

} // namespace

std::optional<Pose>
poseAt(const Trajectory& trajectory, double timestamp, double max_difference)
{
  const auto distance = [timestamp](const TimedPose& pose) {
    return std::abs(pose.timestamp - timestamp);
  };
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), timestamp,
                       [](const TimedPose& pose, double time) { return pose.timestamp < time; });
  auto nearest = after;
  if (after != trajectory.begin() &&
      (after == trajectory.end() || distance(*std::prev(after)) <= distance(*after)))
    nearest = std::prev(after);
  if (nearest == trajectory.end() || distance(*nearest) > max_difference)
    return std::nullopt;
  return nearest->world_from_camera;
}

Trajectory
readTrajectory(const std::string& path)
{
  std::map<double, TimedPose> poses;
  for (const TextLine& line : readTextLines(path)) {
    const TimedPose pose = parsePose(line, path);
    poses[pose.timestamp] = pose;
  }
  if (poses.empty())
    throw IOException(path + ": holds no pose");
  Trajectory trajectory;
  for (const auto& [timestamp, pose] : poses)
    trajectory.push_back(pose);
  return trajectory;
}

void
writeTrajectory(const std::string& path, const Trajectory& trajectory)
{
  writeAtomically(path, [&](const std::string& temporary_path) {
    std::ofstream file(temporary_path);
    file.imbue(std::locale::classic());
    file << "# timestamp tx ty tz qx qy qz qw\n" << std::fixed;
    for (const TimedPose& pose : trajectory) {
      const Eigen::Quaterniond q(pose.world_from_camera.linear());
      const Eigen::Vector3d t = pose.world_from_camera.translation();
      file << std::setprecision(6) << pose.timestamp << std::setprecision(8);
      for (const double value : {t.x(), t.y(), t.z()})
        file << ' ' << value;
      file << std::setprecision(10);
      for (const double value : {q.x(), q.y(), q.z(), q.w()})
        file << ' ' << value;
      file << '\n';
    }
    file.close();
    if (!file)
      throw IOException(path + ": cannot be written: " + std::strerror(errno));
  });
}

std::vector<double>
readTimestamps(const std::string& path)
{
  std::vector<double> timestamps;
  for (const TextLine& line : readTextLines(path))
    timestamps.push_back(parseNumbers({line.number, {line.words[0]}}, path).front());
  if (timestamps.empty())
    throw IOException(path + ": holds no time stamp");
  return timestamps;
}

} // namespace bundle_icp
