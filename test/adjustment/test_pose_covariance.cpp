// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/pose_adjustment.h"

#include "landmarks.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** One frame of landmarks, moved with them by a motion of the world. */
struct View {
  Landmarks landmarks{120};
  LandmarkView view = landmarks.look(randomMotion(3, 0.2, 0.3));
  Pose world = Pose::Identity();

  Pose
  truth() const
  {
    return world * view.world_from_camera;
  }

  std::vector<PointObservation>
  observations() const
  {
    std::vector<PointObservation> result;
    for (std::size_t j = 0; j < view.landmarks.size(); ++j)
      result.push_back({int(j), world * landmarks.point(view.landmarks[j])});
    return result;
  }

  /** Adds noise of the features' own sigmas. */
  void
  addNoise(unsigned seed)
  {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    Features& f = view.features;
    for (std::size_t j = 0; j < f.size(); ++j) {
      f.pixels[j] += f.pixel_sigmas[j] * Eigen::Vector2f(normal(random), normal(random));
      f.depths[j] += f.depth_sigmas[j] * normal(random);
    }
  }

  PoseEstimate
  adjust(const std::vector<PointObservation>& observations, const DensePoseTerm& dense = {}) const
  {
    return adjustPose(toGraph(landmarks, {view}), SparseModel(1), 0, observations, dense, {}, false,
                      {truth()});
  }
};

/** Rotation and displacement of a camera from its true pose, along the axes of the world. */
Vector6d
errorOf(const PoseEstimate& pose, const Pose& truth)
{
  Pose rotation = Pose::Identity();
  rotation.linear() = pose.world_from_camera.linear() * truth.linear().transpose();
  Vector6d error = logarithm(rotation);
  error.tail<3>() = pose.world_from_camera.translation() - truth.translation();
  return error;
}

} // namespace

TEST(PoseCovariance, IsThatOfTheErrorsByNoise)
{
  // Squared errors over the covariance follow chi squared of six degrees of freedom.
  constexpr unsigned RUNS = 80;
  double sum = 0;
  Matrix6d spread = Matrix6d::Zero(), foretold = Matrix6d::Zero();
  for (unsigned seed = 0; seed < RUNS; ++seed) {
    View view;
    view.addNoise(seed);
    const PoseEstimate pose = view.adjust(view.observations());
    const Vector6d error = errorOf(pose, view.truth());
    sum += error.dot(pose.covariance.inverse() * error);
    spread += error * error.transpose() / RUNS;
    foretold += pose.covariance / RUNS;
  }
  // The mean's own standard deviation is 0.39.
  EXPECT_NEAR(sum / RUNS, 6, 1.6);
  for (int k = 0; k < 6; ++k)
    EXPECT_NEAR(std::sqrt(spread(k, k) / foretold(k, k)), 1, 0.3) << k;
}

TEST(PoseCovariance, TurnsWithTheWorld)
{
  View here, there;
  here.addNoise(1);
  there.addNoise(1);
  there.world = randomMotion(8, 1.3, 5);
  const PoseEstimate a = here.adjust(here.observations()), b = there.adjust(there.observations());
  EXPECT_LT(logarithm(there.world * a.world_from_camera * b.world_from_camera.inverse()).norm(),
            1e-5);
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = there.world.linear();
  EXPECT_LT((turn * a.covariance * turn.transpose() - b.covariance).norm(),
            1e-3 * b.covariance.norm());
}

TEST(PoseCovariance, OrderOfObservationsDoesNotMatter)
{
  View view;
  view.addNoise(2);
  std::vector<PointObservation> observations = view.observations();
  const PoseEstimate forwards = view.adjust(observations);
  std::reverse(observations.begin(), observations.end());
  const PoseEstimate backwards = view.adjust(observations);
  EXPECT_LT((forwards.world_from_camera.matrix() - backwards.world_from_camera.matrix()).norm(),
            1e-8);
  EXPECT_LT((forwards.covariance - backwards.covariance).norm(), 1e-6 * forwards.covariance.norm());
}

TEST(PoseCovariance, OfDenseEvidenceAloneIsItsInverse)
{
  View view;
  DensePoseTerm dense;
  dense.world_from_camera = view.truth();
  dense.information = 1e4 * Matrix6d::Identity();
  const PoseEstimate pose = view.adjust({}, dense);
  EXPECT_LT(errorOf(pose, view.truth()).norm(), 1e-9);
  // About the world's origin turning and moving are independent; the camera moves with the turn.
  const double sigma = 1 / std::sqrt(1e4 + PRIOR_INFORMATION);
  EXPECT_NEAR(largestDeviation(pose.covariance.topLeftCorner<3, 3>()), sigma, 1e-3 * sigma);
  const double lever = view.truth().translation().norm();
  EXPECT_NEAR(largestDeviation(pose.covariance.bottomRightCorner<3, 3>()),
              sigma * std::hypot(1, lever), 1e-3 * sigma);
}

TEST(PoseCovariance, ObservationsCountAsExactAsTheyProveToBe)
{
  View exact, noisy, noisier;
  noisy.addNoise(4);
  noisier.addNoise(4);
  noisier.addNoise(4);
  const auto deviation = [](const View& view) {
    return largestDeviation(view.adjust(view.observations()).covariance.bottomRightCorner<3, 3>());
  };
  // Not a single error: never more than four times as exact as the sigmas say.
  EXPECT_NEAR(deviation(noisy) / deviation(exact), 4, 0.6);
  EXPECT_GT(deviation(noisier), 1.3 * deviation(noisy));
}

TEST(LargestDeviation, IsTheLongestAxis)
{
  const Eigen::Matrix3d axes = randomMotion(3, 0.8, 0).linear();
  const Eigen::Vector3d variances(0.25, 9, 4);
  EXPECT_NEAR(largestDeviation(axes * variances.asDiagonal() * axes.transpose()), 3, 1e-12);
  EXPECT_EQ(largestDeviation(Eigen::Matrix3d::Zero()), 0);
  EXPECT_EQ(largestDeviation(-Eigen::Matrix3d::Identity()),
            std::numeric_limits<double>::infinity()); // not a covariance
}
