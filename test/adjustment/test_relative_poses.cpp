// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/landmark_scene.h"
#include "adjustment/pose_covariances.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

Pose
shift(double x, double y = 0, double z = 0)
{
  return Pose(Eigen::Translation3d(x, y, z));
}

/** Frames without a single track: relative poses are all that is known. */
struct PoseGraph {
  ImageGraph graph{smallCamera()};
  SparseModel model;
  BundleAdjustmentProblem problem;

  explicit PoseGraph(const std::vector<Pose>& poses) : model(poses.size())
  {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      model.registerFrame(i, poses[i], 0);
      problem.variable.push_back(i);
    }
  }

  void
  relate(std::size_t first, std::size_t second, const Pose& first_from_second,
         const Matrix6d& information = 1e4 * Matrix6d::Identity())
  {
    problem.relative_poses.push_back({first, second, first_from_second, information});
  }

  BundleAdjustmentResult
  adjust(AdjustmentSolver solver = AdjustmentSolver::AUTO)
  {
    BundleAdjustmentOptions options;
    options.solver = solver;
    options.max_iterations = 100;
    options.function_tolerance = 1e-14;
    return adjustBundle(graph, problem, options, model);
  }

  Pose
  relative(std::size_t first, std::size_t second) const
  {
    return model.worldFromCamera(first).inverse() * model.worldFromCamera(second);
  }
};

double
distance(const Pose& a, const Pose& b)
{
  return logarithm(a * b.inverse()).norm();
}

/** A ring of poses, each off by a little, with terms along it and across it that are a little
 *  wrong, too. */
PoseGraph
disturbedRing()
{
  std::vector<Pose> truth, disturbed;
  for (unsigned i = 0; i < 7; ++i) {
    truth.push_back(Pose(Eigen::AngleAxisd(2 * M_PI * i / 7, Eigen::Vector3d::UnitY())) *
                    shift(0, 0.1 * i, -2));
    disturbed.push_back(randomMotion(i, 0.05, 0.1) * truth.back());
  }
  PoseGraph ring(disturbed);
  for (std::size_t i = 0; i < 7; ++i)
    for (const std::size_t step : {1, 3}) {
      const std::size_t j = (i + step) % 7;
      Matrix6d information = 1e4 * Matrix6d::Identity();
      information.diagonal().tail<3>() *= double(step);
      ring.relate(i, j,
                  randomMotion(unsigned(10 * i + j), 0.01, 0.02) * truth[i].inverse() * truth[j],
                  information);
    }
  return ring;
}

} // namespace

TEST(RelativePoses, TwoThatDisagreeAreWeighedByTheirInformation)
{
  for (const AdjustmentSolver solver : SOLVERS) {
    PoseGraph pair({shift(0), shift(5)});
    pair.relate(0, 1, shift(1), 3e4 * Matrix6d::Identity());
    pair.relate(0, 1, shift(2), 1e4 * Matrix6d::Identity());
    const BundleAdjustmentResult result = pair.adjust(solver);
    EXPECT_TRUE(result.success);
    EXPECT_LT(distance(pair.relative(0, 1), shift((3 * 1 + 1 * 2) / 4.0)), 1e-6);
    EXPECT_NEAR(result.final_cost, (3e4 * 0.25 * 0.25 + 1e4 * 0.75 * 0.75) / 2, 1e-3);
  }
}

TEST(RelativePoses, AnErrorOfClosureIsSharedByTheVariances)
{
  // Along a line 0 ... 3, one step three times as uncertain: information 1/3.
  PoseGraph line({shift(0), shift(1), shift(2), shift(3)});
  line.relate(0, 1, shift(1));
  line.relate(1, 2, shift(1), 1e4 / 3 * Matrix6d::Identity());
  line.relate(2, 3, shift(1));
  line.relate(0, 3, shift(3.6));
  line.adjust();
  const double share = 0.6 / (1 + 3 + 1 + 1);
  EXPECT_LT(distance(line.relative(0, 1), shift(1 + share)), 1e-6);
  EXPECT_LT(distance(line.relative(1, 2), shift(1 + 3 * share)), 1e-6);
  EXPECT_LT(distance(line.relative(0, 3), shift(3.6 - share)), 1e-6);
}

TEST(RelativePoses, DenseTermsShareTheNoiseOfTheirImagesOthersDoNot)
{
  PoseGraph line({shift(0), shift(1), shift(2)});
  line.relate(0, 1, shift(1));
  line.relate(1, 2, shift(1));
  const auto varianceAlong = [&](bool is_dense) {
    for (RelativePoseTerm& term : line.problem.relative_poses)
      term.is_dense = is_dense;
    return poseCovariances(line.graph, line.problem, {}, line.model)[2](3, 3);
  };
  EXPECT_NEAR(varianceAlong(false), 2e-4, 1e-7);
  EXPECT_NEAR(varianceAlong(true), 1.25 * 2e-4, 1e-7); // the middle image counts in both
}

TEST(RelativePoses, ItDoesNotMatterWhichImageFixesTheGauge)
{
  PoseGraph reference = disturbedRing();
  const BundleAdjustmentResult result = reference.adjust();
  EXPECT_LT(result.final_cost, 0.1 * result.initial_cost);
  for (const std::size_t held : {2, 5}) {
    PoseGraph other = disturbedRing();
    std::rotate(other.problem.variable.begin(), other.problem.variable.begin() + long(held),
                other.problem.variable.end());
    const Pose before = other.model.worldFromCamera(held);
    EXPECT_NEAR(other.adjust().final_cost, result.final_cost, 1e-6 * result.final_cost);
    EXPECT_EQ(other.model.worldFromCamera(held).matrix(), before.matrix());
    for (std::size_t i = 0; i < 7; ++i)
      EXPECT_LT(distance(other.relative(0, i), reference.relative(0, i)), 1e-4) << i;
  }
}

TEST(RelativePoses, TheirOrderDoesNotMatter)
{
  PoseGraph reference = disturbedRing(), other = disturbedRing();
  std::reverse(other.problem.relative_poses.begin(), other.problem.relative_poses.end());
  std::reverse(other.problem.variable.begin() + 1, other.problem.variable.end());
  reference.adjust();
  other.adjust();
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_LT(distance(other.model.worldFromCamera(i), reference.model.worldFromCamera(i)), 1e-5);
}

TEST(RelativePoses, TheWorldFrameDoesNotMatter)
{
  PoseGraph here = disturbedRing(), there = disturbedRing();
  const Pose there_from_here = randomMotion(5, 1.2, 4);
  there.model.transform(0, there_from_here);
  EXPECT_NEAR(here.adjust().final_cost, there.adjust().final_cost, 1e-6);
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_LT(
        distance(there_from_here * here.model.worldFromCamera(i), there.model.worldFromCamera(i)),
        1e-4);
}

TEST(RelativePoses, SolversFindTheSameRing)
{
  PoseGraph own = disturbedRing(), ceres = disturbedRing();
  const double cost = own.adjust(AdjustmentSolver::SCHUR).final_cost;
  EXPECT_NEAR(ceres.adjust(AdjustmentSolver::CERES).final_cost, cost, 1e-7 * cost);
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_LT(distance(own.model.worldFromCamera(i), ceres.model.worldFromCamera(i)), 1e-4);
}

TEST(RelativePoses, WhatOneLeavesOpenAnotherSays)
{
  // A plane of constant z holds no motion along x and y, whatever was measured along these.
  PoseGraph pair({shift(0), shift(1, 1, 1.1)});
  Matrix6d information = 1e6 * Matrix6d::Identity();
  information(3, 3) = information(4, 4) = 0;
  pair.relate(0, 1, shift(7, 7, 1), information);
  pair.relate(0, 1, shift(0.3, -0.2, 1.5), Matrix6d::Identity());
  EXPECT_TRUE(pair.adjust().success);
  EXPECT_LT(distance(pair.relative(0, 1), shift(0.3, -0.2, 1)), 1e-4);
}

TEST(RelativePoses, AnImageBetweenTwoThatAreHeldGoesToItsPlace)
{
  for (const AdjustmentSolver solver : SOLVERS) {
    PoseGraph line({shift(0), shift(0.2, 0.5), shift(2)});
    line.problem.variable = {1};
    line.problem.constant = {0, 2};
    line.relate(0, 1, shift(1.1));
    line.relate(2, 1, shift(-1.1));
    line.relate(0, 2, shift(9)); // between frames that are held: costs, but moves nothing
    line.adjust(solver);
    EXPECT_EQ(line.model.worldFromCamera(2).matrix(), shift(2).matrix());
    EXPECT_LT(distance(line.model.worldFromCamera(1), shift(1)), 1e-6);
  }
}
