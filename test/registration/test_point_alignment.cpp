// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// The loop from coarse levels to fine ones, without PCL's interface around it.
#include "frame_pairs.h"
#include "made_matches.h"
#include "variants.h"

#include <bundle_icp/registration/impl/point_alignment.h>

#include <Eigen/Eigenvalues>
#include <pcl/common/transforms.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

Pose
nearTruth(unsigned seed = 1, double angle = 0.05, double distance = 0.03)
{
  return pair().truth * randomMotion(seed, angle, distance);
}

/** Exact matches of points in front of the source's camera, under a pose. */
VisualCorrespondences
matchesUnder(const Pose& pose, double sigma)
{
  std::mt19937 random(2);
  VisualCorrespondences matches;
  for (int i = 0; i < 50; ++i) {
    matches.source.push_back(Eigen::Vector3d(0, 0, 2) + 0.5 * randomVector(random));
    matches.target.push_back(pose * matches.source.back());
    matches.weights.push_back(1 / (sigma * sigma));
  }
  return matches;
}

void
expectSame(const BundleICPResult& a, const BundleICPResult& b)
{
  EXPECT_EQ(a.world_from_source.matrix(), b.world_from_source.matrix());
  EXPECT_EQ(a.information, b.information);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.inliers, b.inliers);
  EXPECT_EQ(a.rmse, b.rmse);
}

} // namespace

TEST(AlignPoints, ThreadsAndInstructionSetsGiveTheSameBits)
{
  AlignmentProblem problem = problemOf(pair());
  problem.num_threads = 1;
  const BundleICPResult expected = alignPoints(problem, nearTruth());
  forEachVariant([&] {
    for (const int threads : {1, 3}) {
      problem.num_threads = threads;
      expectSame(alignPoints(problem, nearTruth()), expected);
    }
  });
}

TEST(AlignPoints, StartsFromAnywhereNearGiveOnePose)
{
  const AlignmentProblem problem = problemOf(pair());
  const BundleICPResult first = alignPoints(problem, nearTruth(1));
  for (unsigned seed = 2; seed < 8; ++seed) {
    const BundleICPResult other = alignPoints(problem, nearTruth(seed));
    EXPECT_EQ(other.status, BundleICPStatus::CONVERGED);
    EXPECT_LT(logarithm(first.world_from_source.inverse() * other.world_from_source).norm(), 2e-3);
    EXPECT_NEAR(other.overlap, first.overlap, 0.02);
  }
}

TEST(AlignPoints, InformationFollowsTheWorldFrame)
{
  AlignmentProblem problem = problemOf(pair());
  const BundleICPResult here = alignPoints(problem, nearTruth());
  const Pose world = randomMotion(3, 1.5, 1);
  Cloud target;
  pcl::transformPointCloudWithNormals(*pair().target, target, world.matrix().cast<float>());
  problem.target = viewPoints(target);
  problem.world_from_virtual = world;
  const BundleICPResult there = alignPoints(problem, world * nearTruth());
  EXPECT_LT(logarithm((world * here.world_from_source).inverse() * there.world_from_source).norm(),
            1e-3);
  // A motion of the old world seen from the new one: turned, and about the old origin.
  const Matrix6d here_from_there = turned(world.linear()).transpose() *
                                   motionsAbout(Eigen::Vector3d::Zero(), world.translation());
  const Matrix6d expected = here_from_there.transpose() * here.information * here_from_there;
  EXPECT_LT(difference(there.information, expected), 0.03);
}

TEST(AlignPoints, EveryIterationIsToldWithItsPoseAndPairs)
{
  AlignmentProblem problem = problemOf(pair());
  int calls = 0;
  Pose last = Pose::Identity();
  problem.on_iteration = [&](const Pose& pose, const std::vector<int>& source,
                             const std::vector<int>& target) {
    ++calls;
    last = pose;
    ASSERT_EQ(source.size(), target.size());
    for (std::size_t i = 0; i < source.size(); i += 500) {
      const Eigen::Vector3f p = (*pair().source)[std::size_t(source[i])].getVector3fMap();
      const Eigen::Vector3f q = (*pair().target)[std::size_t(target[i])].getVector3fMap();
      // At most 0.4 m before the step, which is a few centimetres
      ASSERT_LT(((pose * p.cast<double>()).cast<float>() - q).norm(), 0.6);
    }
  };
  const BundleICPResult found = alignPoints(problem, nearTruth());
  EXPECT_EQ(calls, found.iterations);
  EXPECT_EQ(last.matrix(), found.world_from_source.matrix());
  EXPECT_LT(logarithm(found.last_step).norm(), 1e-3) << "the step that ended the loop";
}

TEST(AlignPoints, MisalignmentThatIsAllowedDecidesHowFarItSearches)
{
  AlignmentProblem problem = problemOf(pair());
  const Pose far = nearTruth(4, 0.1, 0.15);
  const auto errorWith = [&](double misalignment) {
    problem.max_misalignment = misalignment;
    const Pose found = alignPoints(problem, far).world_from_source;
    return (pair().truth.inverse() * found).translation().norm();
  };
  EXPECT_LT(errorWith(0.3), 0.002);
  problem.max_misalignment = 0.3;
  const int usual = alignPoints(problem, nearTruth(1, 0.002, 0.002)).iterations;
  problem.max_misalignment = 0;
  const BundleICPResult quick = alignPoints(problem, nearTruth(1, 0.002, 0.002));
  EXPECT_LT(quick.iterations, usual);
  EXPECT_LT((pair().truth.inverse() * quick.world_from_source).translation().norm(), 0.002);
}

TEST(AlignPoints, VisualEvidenceShiftsThePoseByItsShareAndDenseEvidenceIsToldApart)
{
  AlignmentProblem problem = problemOf(pair());
  const Pose dense = alignPoints(problem, pair().truth).world_from_source;
  // Matches that are 4 mm off, first vague, then far more exact than depth
  Pose visual = dense;
  visual.translation() += Eigen::Vector3d(0.004, 0, 0);
  double before = 0;
  for (const double sigma : {0.5, 0.01, 1e-5}) {
    problem.visual = matchesUnder(visual, sigma);
    const BundleICPResult found = alignPoints(problem, visual);
    const double shift = (found.world_from_source.translation() - dense.translation()).norm();
    EXPECT_GE(shift, before - 1e-4) << sigma;
    before = shift;
    EXPECT_LT((found.dense_pose.translation() - dense.translation()).norm(), 0.001)
        << "counts no match, sigma " << sigma;
    EXPECT_TRUE(found.visual_initial_pose);
  }
  EXPECT_NEAR(before, 0.004, 5e-4);
}

TEST(AlignPoints, DistanceOfInliersIsTheNoiseOfTheDepth)
{
  const DepthNoise noise = room().camera().depth_noise;
  const FramePairData exact = framePair(3, 4);
  const cv::Mat depth = room().readExact(4).depth;
  const Cloud::Ptr shaken = toPointCloud(makeDepthView(noisy(depth, 1), room().camera()));
  double squared = 0, count = 0;
  for (const Point& point : *shaken)
    if (std::isfinite(point.z) && std::isfinite(point.normal_z)) {
      const double cosine = -point.normal_z; // of noise along the axis, across the surface
      squared += std::pow(noise.sigma(double(point.z)) * cosine, 2);
      count += 1;
    }
  AlignmentProblem problem = problemOf({shaken, exact.target, exact.truth});
  const double rmse = alignPoints(problem, exact.truth).rmse;
  const double expected = std::sqrt(squared / count);
  EXPECT_GT(rmse, 0.5 * expected);
  EXPECT_LT(rmse, 1.3 * expected);
}

TEST(AlignPoints, LargestDeviationOfManyDrawsIsNotBeyondItsCovariance)
{
  // White noise averages better than the noise of whole patches for which the information allows.
  const FramePairData exact = framePair(3, 4);
  const cv::Mat depth = room().readExact(4).depth;
  double normalised = 0;
  constexpr unsigned RUNS = 10;
  Vector6d mean = Vector6d::Zero();
  for (unsigned seed = 0; seed < RUNS; ++seed) {
    const Cloud::Ptr shaken = toPointCloud(makeDepthView(noisy(depth, seed), room().camera()));
    const BundleICPResult found =
        alignPoints(problemOf({shaken, exact.target, exact.truth}), exact.truth);
    const Vector6d error = logarithm(exact.truth * found.dense_pose.inverse());
    normalised += error.dot(found.information * error) / (6 * RUNS);
    mean += error / RUNS;
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(found.information).eigenvalues()[0], 0);
  }
  EXPECT_LT(normalised, 1.5);
  EXPECT_GT(normalised, 1e-3) << "nor is it a hundred times too careful";
  EXPECT_LT(mean.norm(), 0.002);
}

TEST(AlignPoints, CloudsThatAreNothingOrApartAreReported)
{
  AlignmentProblem problem = problemOf(pair());
  Pose away = pair().truth;
  away.translation().x() += 20;
  const BundleICPResult apart = alignPoints(problem, away);
  EXPECT_EQ(apart.status, BundleICPStatus::TOO_FEW_CORRESPONDENCES);
  EXPECT_EQ(apart.world_from_source.matrix(), away.matrix());
  EXPECT_EQ(apart.inliers, 0u);
  EXPECT_EQ(apart.overlap, 0);

  const std::vector<int> none;
  problem.source_indices = &none;
  const BundleICPResult nothing = alignPoints(problem, away);
  EXPECT_EQ(nothing.status, BundleICPStatus::INVALID_INPUT);
  EXPECT_EQ(nothing.world_from_source.matrix(), away.matrix());
  EXPECT_EQ(nothing.iterations, 0);
}
