// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"

#include <bundle_icp/registration/visual_pose.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double SIGMA = 0.005;

/** Noisy correspondences under `truth`, the last `outliers` of them arbitrary. */
VisualCorrespondences
correspondences(const Pose& truth, std::size_t size, std::size_t outliers, double sigma = SIGMA)
{
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  VisualCorrespondences c;
  for (std::size_t i = 0; i < size; ++i) {
    const Eigen::Vector3d p(uniform(random), uniform(random), 2 + uniform(random));
    Eigen::Vector3d q = truth * p;
    q += sigma / std::sqrt(3.0) * Eigen::Vector3d(normal(random), normal(random), normal(random));
    if (i >= size - outliers)
      q = 2 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    c.source.push_back(p);
    c.target.push_back(q);
    c.weights.push_back(1 / (SIGMA * SIGMA));
  }
  return c;
}

double
distance(const Pose& a, const Pose& b)
{
  return (a.inverse() * b).translation().norm();
}

} // namespace

TEST(VisualPose, ExactPointsGiveTheExactPose)
{
  const Pose truth = randomMotion(1, 2.5, 3);
  const auto pose = estimateVisualPose(correspondences(truth, 20, 0, 0));
  ASSERT_TRUE(pose);
  EXPECT_LT(logarithm(truth.inverse() * pose->target_from_source).norm(), 1e-9);
  EXPECT_EQ(pose->inliers.size(), 20u);
}

TEST(VisualPose, HalfOutliersDoNotMoveIt)
{
  const Pose truth = randomMotion(2, 1, 1);
  const auto pose = estimateVisualPose(correspondences(truth, 200, 100));
  ASSERT_TRUE(pose);
  EXPECT_LT(distance(truth, pose->target_from_source), 0.003);
  EXPECT_NEAR(double(pose->inliers.size()), 100, 5);
  EXPECT_NEAR(pose->rmse, SIGMA, 0.2 * SIGMA);
}

TEST(VisualPose, IsTheSameFromRunToRun)
{
  const VisualCorrespondences c = correspondences(randomMotion(2, 1, 1), 100, 40);
  EXPECT_EQ(estimateVisualPose(c)->target_from_source.matrix(),
            estimateVisualPose(c)->target_from_source.matrix());
}

TEST(VisualPose, WithoutConsensusThereIsNone)
{
  EXPECT_FALSE(estimateVisualPose(correspondences(Pose::Identity(), 60, 60)));
  EXPECT_FALSE(estimateVisualPose(correspondences(Pose::Identity(), 4, 0)));
  EXPECT_FALSE(estimateVisualPose({}));
  VisualCorrespondences line = correspondences(Pose::Identity(), 20, 0, 0);
  for (std::size_t i = 0; i < line.source.size(); ++i)
    line.source[i] = line.target[i] = Eigen::Vector3d(0.1 * double(i), 0, 1);
  EXPECT_FALSE(estimateVisualPose(line)) << "points on a line leave a rotation open";
}

TEST(VisualPose, WeightsRule)
{
  const Pose truth = randomMotion(4, 0.3, 0.3);
  VisualCorrespondences c = correspondences(truth, 60, 0, 0);
  for (std::size_t i = 0; i < 30; ++i) { // half of them are 2 cm off, and say so
    c.target[i].x() += 0.02;
    c.weights[i] = 1 / (0.1 * 0.1);
  }
  EXPECT_LT(distance(truth, estimateVisualPose(c)->target_from_source), 0.001);
}

TEST(VisualPose, RefusesFaultyListsNamingTheFault)
{
  const auto message = [](const VisualCorrespondences& c) {
    std::string error;
    EXPECT_FALSE(isValid(c, &error));
    EXPECT_THROW(estimateVisualPose(c), pcl::BadArgumentException);
    return error;
  };
  VisualCorrespondences c = correspondences(Pose::Identity(), 10, 0);
  c.weights.pop_back();
  EXPECT_NE(message(c).find("9 weights"), std::string::npos);
  c = correspondences(Pose::Identity(), 10, 0);
  c.target[3].y() = std::nan("");
  EXPECT_NE(message(c).find("point 3"), std::string::npos);
  c = correspondences(Pose::Identity(), 10, 0);
  c.weights[7] = 0;
  EXPECT_NE(message(c).find("weight 7"), std::string::npos);
  VisualPoseOptions options;
  options.min_inliers = 2;
  EXPECT_THROW(estimateVisualPose({}, options), pcl::BadArgumentException);
  options = {};
  options.alignment.max_samples = 0;
  EXPECT_THROW(estimateVisualPose({}, options), pcl::BadArgumentException);
}
