// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What the pose from visual correspondences is worth, and what it does not depend on.
#include "registration/normal_equations.h"

#include "made_matches.h"
#include "messages.h"

#include <bundle_icp/registration/visual_pose.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Pairs under a pose, of which each has a noise of its own and a weight that knows it. */
VisualCorrespondences
pairsUnder(const Pose& truth, std::size_t size, unsigned seed, double sigmas = 1)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.002, 0.02);
  VisualCorrespondences pairs;
  for (std::size_t i = 0; i < size; ++i) {
    const double sigma = uniform(random);
    const Eigen::Vector3d point = randomVector(random);
    pairs.source.push_back(point);
    pairs.target.push_back(truth * point + sigmas * sigma * randomVector(random));
    pairs.weights.push_back(1 / (sigma * sigma));
  }
  return pairs;
}

double
poseDifference(const Pose& a, const Pose& b)
{
  return logarithm(a.inverse() * b).norm();
}

} // namespace

TEST(VisualPoseStatistics, ErrorsScatterAsTheWeightsPromise)
{
  const Pose truth = randomMotion(1, 1, 2);
  double normalised = 0;
  constexpr unsigned RUNS = 200;
  for (unsigned seed = 0; seed < RUNS; ++seed) {
    const VisualCorrespondences pairs = pairsUnder(truth, 60, seed);
    const std::optional<RigidAlignment> pose = estimateVisualPose(pairs);
    ASSERT_TRUE(pose);
    const Vector6d error = logarithm(truth * pose->target_from_source.inverse());
    Matrix6d information = Matrix6d::Zero(); // of increments on the left, about the origin
    for (std::size_t i = 0; i < pairs.source.size(); ++i) {
      Eigen::Matrix<double, 3, 6> jacobian;
      jacobian << -crossMatrix(truth * pairs.source[i]), Eigen::Matrix3d::Identity();
      information += pairs.weights[i] * jacobian.transpose() * jacobian;
    }
    normalised += error.dot(information * error) / (6 * RUNS);
  }
  // The mean of 200 times 6 squares has a deviation of 0.04; the robust fit loses a little.
  EXPECT_GT(normalised, 0.85);
  EXPECT_LT(normalised, 1.25);
}

TEST(VisualPoseStatistics, ScaleIsByHowMuchTheWeightsAreTooOptimistic)
{
  const Pose truth = randomMotion(2, 1, 2);
  for (const double sigmas : {1.0, 1.5}) {
    const std::optional<RigidAlignment> pose =
        estimateVisualPose(pairsUnder(truth, 3000, 1, sigmas));
    ASSERT_TRUE(pose);
    EXPECT_NEAR(pose->scale, sigmas, 0.1) << sigmas;
  }
  EXPECT_EQ(estimateVisualPose(pairsUnder(truth, 3000, 1, 0.2))->scale, 1)
      << "better data than expected are no reason to trust them more";
}

TEST(VisualPoseStatistics, DistanceIsThatOfTheInliers)
{
  const std::optional<RigidAlignment> pose =
      estimateVisualPose(pairsUnder(randomMotion(3, 1, 2), 5000, 2));
  ASSERT_TRUE(pose);
  // Three coordinates of each pair, of sigmas spread evenly from 2 to 20 mm
  const double mean_square = (8e-6 - 8e-9) / (3 * 0.018);
  EXPECT_NEAR(pose->rmse, std::sqrt(3 * mean_square), 1e-3);
}

TEST(VisualPoseInvariance, OfTheWorldFrameTheCameraFrameAndTheDirection)
{
  VisualCorrespondences pairs = pairsUnder(randomMotion(4, 1, 2), 100, 3);
  const Pose here = estimateVisualPose(pairs)->target_from_source;

  VisualCorrespondences swapped = pairs;
  std::swap(swapped.source, swapped.target);
  EXPECT_LT(poseDifference(estimateVisualPose(swapped)->target_from_source, here.inverse()), 1e-6);

  const Pose world = randomMotion(5, 2, 3), camera = randomMotion(6, 2, 3);
  for (std::size_t i = 0; i < pairs.source.size(); ++i) {
    pairs.target[i] = world * pairs.target[i];
    pairs.source[i] = camera * pairs.source[i];
  }
  EXPECT_LT(poseDifference(estimateVisualPose(pairs)->target_from_source,
                           world * here * camera.inverse()),
            1e-6);
}

TEST(VisualPoseInvariance, OfTheOrderAndTheUnit)
{
  const VisualCorrespondences pairs = pairsUnder(randomMotion(7, 1, 2), 100, 4);
  const std::optional<RigidAlignment> here = estimateVisualPose(pairs);
  VisualCorrespondences reversed = pairs;
  std::reverse(reversed.source.begin(), reversed.source.end());
  std::reverse(reversed.target.begin(), reversed.target.end());
  std::reverse(reversed.weights.begin(), reversed.weights.end());
  EXPECT_LT(
      poseDifference(estimateVisualPose(reversed)->target_from_source, here->target_from_source),
      1e-5)
      << "other samples, the same minimum";

  VisualCorrespondences millimetres = pairs;
  for (std::size_t i = 0; i < pairs.source.size(); ++i) {
    millimetres.source[i] *= 1000;
    millimetres.target[i] *= 1000;
    millimetres.weights[i] /= 1e6;
  }
  const std::optional<RigidAlignment> scaled = estimateVisualPose(millimetres);
  EXPECT_NEAR(scaled->rmse, 1000 * here->rmse, 1e-3);
  EXPECT_NEAR(scaled->scale, here->scale, 1e-6);
  Pose in_metres = scaled->target_from_source;
  in_metres.translation() /= 1000;
  EXPECT_LT(poseDifference(in_metres, here->target_from_source), 1e-6);
}

TEST(VisualPoseInvariance, RobustStepOfItsOwnResultIsSmall)
{
  // The normal equations of the alignment agree with the fit that starts it.
  const VisualCorrespondences pairs = pairsUnder(randomMotion(8, 1, 2), 200, 5, 0.3);
  const std::optional<RigidAlignment> pose = estimateVisualPose(pairs);
  ASSERT_TRUE(pose);
  const VisualSystem system =
      accumulateVisual(pairs, pose->target_from_source, Eigen::Vector3d::Zero(), 1);
  EXPECT_EQ(system.inliers, 200u);
  EXPECT_LT(solve({}, 1, system, {}).delta.norm(), 2e-4);
}

TEST(VisualPoseRefusals, SayWhatIsWrong)
{
  const VisualCorrespondences good = pairsUnder(Pose::Identity(), 10, 1);
  const auto messageAfter = [&](const auto& change) {
    VisualCorrespondences pairs = good;
    change(pairs);
    return messageOf<pcl::BadArgumentException>([&] { estimateVisualPose(pairs); });
  };
  using Pairs = VisualCorrespondences;
  const std::string prefix = "estimateVisualPose: visual correspondences: ";
  EXPECT_CONTAINS(messageAfter([](Pairs& pairs) { pairs.target.pop_back(); }),
                  prefix + "10 source points, 9 target points and 10 weights; expected equally "
                           "many");
  EXPECT_CONTAINS(messageAfter([](Pairs& pairs) { pairs.source[4].z() = std::nan(""); }),
                  prefix + "point 4 is not finite");
  for (const double weight : {0.0, -2.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_CONTAINS(messageAfter([&](Pairs& pairs) { pairs.weights[6] = weight; }),
                    prefix + "weight 6 is " + std::to_string(weight) +
                        "; expected a positive number");
  VisualPoseOptions options;
  options.min_inliers = 2;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { estimateVisualPose(good, options); }),
                  "estimateVisualPose: min_inliers must be >= 3");
  options.min_inliers = 11;
  EXPECT_FALSE(estimateVisualPose(good, options)) << "few pairs are no fault";
}
