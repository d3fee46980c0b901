// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "refinement/trajectory_smoothing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace bundle_icp {
namespace {

constexpr double SIGMA_ROTATION = 1e-3, SIGMA_POSITION = 2e-3; // [rad], [m]

/** A hand's path: some 20 cm and 0.3 rad, back and forth in about two seconds. */
Pose
truePose(double time)
{
  Vector6d motion;
  motion << 0.3 * std::sin(2.9 * time), 0.2 * std::cos(3.3 * time), 0.1 * std::sin(2.1 * time),
      0.2 * std::cos(2.6 * time), 0.1 * std::sin(3.1 * time), 0.2 * std::sin(1.7 * time);
  return increment(motion);
}

std::vector<PoseMeasurement>
measure(std::size_t count, double step, double noise, std::vector<Pose>* truth = nullptr)
{
  std::mt19937 engine(7);
  std::normal_distribution<double> normal;
  std::vector<PoseMeasurement> measurements;
  for (std::size_t k = 0; k < count; ++k) {
    PoseMeasurement m;
    m.time = 100 + double(k) * step;
    const Pose pose = truePose(m.time);
    Vector6d turn = Vector6d::Zero();
    for (int i = 0; i < 3; ++i)
      turn[i] = noise * SIGMA_ROTATION * normal(engine);
    m.world_from_camera = increment(turn) * pose;
    m.world_from_camera.translation() = pose.translation();
    for (int i = 0; i < 3; ++i)
      m.world_from_camera.translation()[i] += noise * SIGMA_POSITION * normal(engine);
    m.covariance = Matrix6d::Zero();
    m.covariance.diagonal() << Eigen::Vector3d::Constant(SIGMA_ROTATION * SIGMA_ROTATION),
        Eigen::Vector3d::Constant(SIGMA_POSITION * SIGMA_POSITION);
    measurements.push_back(m);
    if (truth)
      truth->push_back(pose);
  }
  return measurements;
}

std::vector<Pose>
smoothed(const std::vector<PoseMeasurement>& measurements)
{
  std::vector<Pose> poses;
  for (const PoseEstimate& pose : smoothTrajectory(measurements, estimateMotionPrior(measurements)))
    poses.push_back(pose.world_from_camera);
  return poses;
}

std::vector<Pose>
posesOf(const std::vector<PoseMeasurement>& measurements)
{
  std::vector<Pose> poses;
  for (const PoseMeasurement& m : measurements)
    poses.push_back(m.world_from_camera);
  return poses;
}

/** RMS distance of positions [m] and rotations [rad]. */
std::pair<double, double>
errors(const std::vector<Pose>& a, const std::vector<Pose>& b)
{
  double position = 0, rotation = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    position += (a[k].translation() - b[k].translation()).squaredNorm();
    rotation += std::pow(rotationAngle(a[k].inverse() * b[k]), 2);
  }
  return {std::sqrt(position / double(a.size())), std::sqrt(rotation / double(a.size()))};
}

TEST(SmoothTrajectory, RemovesNoiseAtTheRateOfAVideo)
{
  std::vector<Pose> truth;
  const auto measurements = measure(200, 1.0 / 30, 1, &truth);
  const auto before = errors(posesOf(measurements), truth);
  const auto after = errors(smoothed(measurements), truth);
  EXPECT_LT(after.first, 0.7 * before.first);
  EXPECT_LT(after.second, 0.7 * before.second);
}

TEST(SmoothTrajectory, LeavesExactPosesWhereTheyAre)
{
  std::vector<Pose> truth;
  const auto measurements = measure(200, 1.0 / 30, 0, &truth);
  const auto after = errors(smoothed(measurements), truth);
  EXPECT_LT(after.first, 0.1 * SIGMA_POSITION);
  EXPECT_LT(after.second, 0.1 * SIGMA_ROTATION);
}

TEST(SmoothTrajectory, LearnsLittleFromFramesFarApart)
{
  std::vector<Pose> truth;
  const auto measurements = measure(60, 1.5, 1, &truth);
  const auto moved = errors(smoothed(measurements), posesOf(measurements));
  EXPECT_LT(moved.first, 0.2 * SIGMA_POSITION);
  EXPECT_LT(moved.second, 0.2 * SIGMA_ROTATION);
}

TEST(SmoothTrajectory, FindsNoiseThatTheCovariancesDoNotKnow)
{
  const auto honest = estimateMotionPrior(measure(300, 1.0 / 30, 1));
  const auto modest = estimateMotionPrior(measure(300, 1.0 / 30, 3));
  EXPECT_LT(honest.noise, 1.6);
  EXPECT_NEAR(modest.noise, 9, 3);
}

TEST(SmoothTrajectory, PullsAnOutlierBack)
{
  std::vector<Pose> truth;
  auto measurements = measure(200, 1.0 / 30, 1, &truth);
  measurements[100].world_from_camera.translation().x() += 0.05;
  const std::vector<Pose> poses = smoothed(measurements);
  EXPECT_LT((poses[100].translation() - truth[100].translation()).norm(), 0.01);
  EXPECT_LT((poses[97].translation() - truth[97].translation()).norm(), 0.005);
}

TEST(SmoothTrajectory, DoesNotDependOnTheWorldFrame)
{
  auto measurements = measure(50, 1.0 / 30, 1);
  const std::vector<Pose> poses = smoothed(measurements);
  const Pose other = increment((Vector6d() << 1, -2, 0.5, 30, -20, 10).finished());
  Matrix6d axes = Matrix6d::Zero();
  axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = other.linear();
  for (PoseMeasurement& m : measurements) {
    m.world_from_camera = other * m.world_from_camera;
    m.covariance = axes * m.covariance * axes.transpose();
  }
  const std::vector<Pose> moved = smoothed(measurements);
  for (std::size_t k = 0; k < poses.size(); ++k)
    EXPECT_TRUE(moved[k].isApprox(other * poses[k], 1e-7)) << k;
}

TEST(SmoothTrajectory, KeepsOneAndNone)
{
  EXPECT_TRUE(smoothed({}).empty());
  const auto one = measure(1, 1, 1);
  ASSERT_EQ(smoothed(one).size(), 1u);
  EXPECT_TRUE(smoothed(one)[0].isApprox(one[0].world_from_camera));
}

} // namespace
} // namespace bundle_icp
