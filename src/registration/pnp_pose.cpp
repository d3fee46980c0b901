// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/pnp_pose.h"

#include <opencv2/calib3d.hpp>

namespace bundle_icp {
namespace {

constexpr int MAX_SAMPLES = 2000;
/** Reprojection error up to which a point supports a pose [px]: points come from single
 * depth measurements, so that it must hold their noise, too. */
constexpr float MAX_ERROR = 4;
constexpr double CONFIDENCE = 0.9999;
/** What a pose from samples of four needs beyond the sample itself. */
constexpr std::size_t MIN_POINTS = 6;

Pose
toPose(const cv::Mat& camera_from_world_rotation, const cv::Mat& translation)
{
  cv::Matx33d rotation;
  cv::Rodrigues(camera_from_world_rotation, rotation);
  Pose camera_from_world = Pose::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      camera_from_world.linear()(row, column) = rotation(row, column);
    camera_from_world.translation()[row] = translation.at<double>(row);
  }
  return closestPose(camera_from_world.matrix()).inverse();
}

} // namespace

std::optional<RigidAlignment>
estimatePnPPose(const CameraIntrinsics& camera, const std::vector<cv::Point2d>& pixels,
                const std::vector<Eigen::Vector3d>& points)
{
  if (points.size() < MIN_POINTS)
    return std::nullopt;
  std::vector<cv::Point3d> objects;
  for (const Eigen::Vector3d& point : points)
    objects.emplace_back(point.x(), point.y(), point.z());
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(objects, pixels, matrix, cv::noArray(), rotation, translation, false,
                          MAX_SAMPLES, MAX_ERROR, CONFIDENCE, inliers, cv::SOLVEPNP_AP3P) ||
      inliers.size() < MIN_POINTS)
    return std::nullopt;
  std::vector<cv::Point3d> agreeing_objects;
  std::vector<cv::Point2d> agreeing_pixels;
  for (const int i : inliers) {
    agreeing_objects.push_back(objects[std::size_t(i)]);
    agreeing_pixels.push_back(pixels[std::size_t(i)]);
  }
  cv::solvePnPRefineLM(agreeing_objects, agreeing_pixels, matrix, cv::noArray(), rotation,
                       translation);
  RigidAlignment result;
  result.success = true;
  result.target_from_source = toPose(rotation, translation);
  result.inliers.assign(inliers.begin(), inliers.end());
  return result;
}

} // namespace bundle_icp
