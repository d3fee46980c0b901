// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "scenes.h"

#include <bundle_icp/registration/bundle_icp.h>

#include <gtest/gtest.h>

namespace bundle_icp::test {

using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;
using Registration = BundleICP<Point, Point>;

/** Two frames of the room, the target in its own camera frame. */
struct FramePairData {
  Cloud::Ptr source, target;
  Pose truth; // target from source
};

inline FramePairData
framePair(std::size_t target, std::size_t source, bool with_noise = false)
{
  const auto cloud = [&](std::size_t i) {
    const cv::Mat exact = room().readExact(i).depth;
    return toPointCloud(
        makeDepthView(with_noise ? noisy(exact, unsigned(i)) : exact, room().camera()));
  };
  return {cloud(source), cloud(target),
          room().worldFromCamera(target).inverse() * room().worldFromCamera(source)};
}

inline const FramePairData&
pair()
{
  static const FramePairData data = framePair(3, 5);
  return data;
}

inline Pose
poseOf(Registration& reg)
{
  Pose pose;
  pose.matrix() = reg.getFinalTransformation().cast<double>();
  return pose;
}

inline Eigen::Matrix4f
perturbed(const Pose& truth, unsigned seed = 1, double angle = 5 * M_PI / 180,
          double distance = 0.05)
{
  return (truth * randomMotion(seed, angle, distance)).matrix().cast<float>();
}

inline void
setUp(Registration& reg, const FramePairData& data)
{
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(data.source);
  reg.setInputTarget(data.target);
}

inline void
expectPose(const Pose& actual, const Pose& truth, double metres, double angle)
{
  const Pose error = truth.inverse() * actual;
  EXPECT_LT(error.translation().norm(), metres);
  EXPECT_LT(degrees(rotationAngle(error)), angle);
}

/** The frames of pair(), the target in its own camera frame. */
inline AlignmentProblem
problemOf(const FramePairData& data)
{
  AlignmentProblem problem;
  problem.source = viewPoints(*data.source);
  problem.target = viewPoints(*data.target);
  problem.camera = room().camera();
  return problem;
}

} // namespace bundle_icp::test
