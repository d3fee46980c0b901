// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/rigid_alignment.h>

#include "messages.h"

#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace bundle_icp;

namespace {

const double SIGMA = 0.005; // [m]

Pose
motion()
{
  return increment((Vector6d() << 0.4, -0.7, 0.2, 0.5, -1, 0.3).finished());
}

Eigen::Vector3d
randomPoint(std::mt19937& random, double size)
{
  std::uniform_real_distribution<double> uniform(-size, size);
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return {x, y, z};
}

/** Pairs that motion() brings together up to noise; the first `outliers` of them do not
 * belong together. */
std::vector<PointPair>
makePairs(std::size_t count, std::size_t outliers, double sigma)
{
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, sigma > 0 ? sigma : 1);
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    PointPair pair;
    pair.source = randomPoint(random, 1.5);
    pair.target = i < outliers ? randomPoint(random, 1.5) : motion() * pair.source;
    if (sigma > 0)
      for (int k = 0; k < 3; ++k)
        pair.target[k] += normal(random);
    pair.weight = 1 / (SIGMA * SIGMA);
    pairs.push_back(pair);
  }
  return pairs;
}

} // namespace

TEST(RigidAlignment, IsExactOnExactPairs)
{
  const Pose pose = *rigidAlignment(makePairs(10, 0, 0));
  EXPECT_LT((pose.matrix() - motion().matrix()).norm(), 1e-12);
}

TEST(RigidAlignment, NeverMirrors)
{
  // Points in a plane fit a reflection as well as a rotation.
  std::vector<PointPair> pairs = makePairs(10, 0, 0);
  for (PointPair& pair : pairs) {
    pair.source.z() = 0;
    pair.target = motion() * pair.source;
  }
  const Pose pose = *rigidAlignment(pairs);
  EXPECT_NEAR(pose.linear().determinant(), 1, 1e-12);
  EXPECT_LT((pose.matrix() - motion().matrix()).norm(), 1e-12);
}

TEST(RigidAlignment, IsWeighted)
{
  std::vector<PointPair> pairs = makePairs(12, 2, 0);
  std::vector<double> weights(12, 1);
  weights[0] = weights[1] = 0;
  EXPECT_LT((rigidAlignment(pairs, weights)->matrix() - motion().matrix()).norm(), 1e-12);
  pairs[0].weight = pairs[1].weight = 1e-9;
  EXPECT_LT((rigidAlignment(pairs)->matrix() - motion().matrix()).norm(), 1e-9);
}

TEST(RobustRigidAlignment, FindsTheMotionAmongSixtyPercentOutliers)
{
  const RigidAlignment result = robustRigidAlignment(makePairs(200, 120, SIGMA));
  ASSERT_TRUE(result.success);
  const Pose error = result.target_from_source * motion().inverse();
  EXPECT_LT(error.translation().norm(), 0.004);
  EXPECT_LT(rotationAngle(error), 0.003);
  ASSERT_GE(result.inliers.size(), 72u); // 3.5 sigma of three coordinates: 99.3 % of 80
  EXPECT_TRUE(std::is_sorted(result.inliers.begin(), result.inliers.end()));
  EXPECT_GE(result.inliers.front(), 120u);
}

TEST(RobustRigidAlignment, DependsOnItsArgumentsAlone)
{
  const std::vector<PointPair> pairs = makePairs(150, 90, SIGMA);
  const RigidAlignment a = robustRigidAlignment(pairs), b = robustRigidAlignment(pairs);
  EXPECT_EQ(a.target_from_source.matrix(), b.target_from_source.matrix());
  EXPECT_EQ(a.inliers, b.inliers);
  RigidAlignmentOptions options;
  options.seed = 5; // other samples, the same consensus
  const RigidAlignment c = robustRigidAlignment(pairs, options);
  EXPECT_LT((a.target_from_source.matrix() - c.target_from_source.matrix()).norm(), 1e-3);
}

TEST(RobustRigidAlignment, MovesWithTheTargetFrame)
{
  std::vector<PointPair> pairs = makePairs(100, 40, SIGMA);
  const Pose before = robustRigidAlignment(pairs).target_from_source;
  const Pose change = increment((Vector6d() << -1, 0.2, 0.9, 3, 1, -2).finished());
  for (PointPair& pair : pairs)
    pair.target = change * pair.target;
  const Pose after = robustRigidAlignment(pairs).target_from_source;
  EXPECT_LT((after.matrix() - (change * before).matrix()).norm(), 1e-9);
}

TEST(RobustRigidAlignment, RefusesFewerThanThreePairs)
{
  for (std::size_t count = 0; count < 3; ++count) {
    const RigidAlignment result = robustRigidAlignment(makePairs(count, 0, 0));
    EXPECT_FALSE(result.success);
    EXPECT_TRUE(result.inliers.empty());
  }
}

TEST(RobustRigidAlignment, RefusesPointsOnALine)
{
  for (const double width : {0.0, 0.5 * SIGMA}) {
    std::vector<PointPair> pairs = makePairs(60, 0, 0);
    for (PointPair& pair : pairs) {
      pair.source =
          Eigen::Vector3d(pair.source.x(), width * pair.source.y(), width * pair.source.z());
      pair.target = motion() * pair.source;
    }
    EXPECT_FALSE(robustRigidAlignment(pairs).success) << width;
  }
}

TEST(RobustRigidAlignment, RefusesPairsWithoutConsensus)
{
  EXPECT_LT(robustRigidAlignment(makePairs(60, 60, 0)).inliers.size(), 8u);
}

TEST(RobustRigidAlignment, RefusesInvalidOptions)
{
  const auto message = [](RigidAlignmentOptions options) {
    return messageOf<pcl::BadArgumentException>(
        [&] { robustRigidAlignment(makePairs(5, 0, 0), options); });
  };
  RigidAlignmentOptions options;
  options.inlier_sigmas = 0;
  EXPECT_CONTAINS(message(options), "robustRigidAlignment: inlier_sigmas must be > 0");
  options = {};
  options.max_samples = 0;
  EXPECT_CONTAINS(message(options), "max_samples must be >= 1");
  options = {};
  options.confidence = 1;
  EXPECT_CONTAINS(message(options), "confidence must lie in (0, 1)");
}
