// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/held_back.h"
#include "adjustment/landmark_scene.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST(AdjustBundle, RecoversTheTruth)
{
  LandmarkScene scene;
  scene.perturb();
  ASSERT_GT(scene.largestPoseError(), 0.01);
  const BundleAdjustmentResult result = adjustBundle(scene.graph, scene.problem, {}, scene.model);
  EXPECT_TRUE(result.success);
  EXPECT_GT(result.iterations, 1);
  EXPECT_GT(result.num_residuals, 1000u);
  EXPECT_LT(result.final_cost, 1e-2);
  EXPECT_LT(scene.largestPoseError(), 1e-4);
  EXPECT_LT(scene.largestPointError(), 1e-4);
}

TEST(AdjustBundle, PixelsAloneKeepTheShape)
{
  LandmarkScene scene;
  scene.perturb();
  BundleAdjustmentOptions options;
  options.use_depth = false;
  const BundleAdjustmentResult with = adjustBundle(scene.graph, scene.problem, {}, scene.model);
  scene.perturb();
  const BundleAdjustmentResult without =
      adjustBundle(scene.graph, scene.problem, options, scene.model);
  EXPECT_TRUE(without.success);
  EXPECT_EQ(with.num_residuals, without.num_residuals / 2 * 3);
  EXPECT_LT(without.final_cost, 1e-2);
}

TEST(AdjustBundle, HoldsTheFirstImageWhichFixesTheGauge)
{
  LandmarkScene scene;
  scene.perturb();
  scene.problem.variable = {3, 0, 1, 2, 4, 5};
  std::vector<Eigen::Matrix4d> before;
  for (std::size_t i = 0; i < 6; ++i)
    before.push_back(scene.model.worldFromCamera(i).matrix());
  adjustBundle(scene.graph, scene.problem, {}, scene.model);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(scene.model.worldFromCamera(i).matrix() == before[i], i == 3) << i;
}

TEST(AdjustBundle, ConstantImagesStayBitEqual)
{
  LandmarkScene scene;
  scene.perturb();
  scene.problem.variable = {1, 2, 5};
  scene.problem.constant = {0, 3};
  std::vector<Eigen::Matrix4d> before;
  for (std::size_t i = 0; i < 6; ++i)
    before.push_back(scene.model.worldFromCamera(i).matrix());
  EXPECT_TRUE(adjustBundle(scene.graph, scene.problem, {}, scene.model).success);
  for (const std::size_t i : {0, 3, 4}) // 4 takes no part
    EXPECT_EQ(scene.model.worldFromCamera(i).matrix(), before[i]) << i;
  for (const std::size_t i : {1, 2, 5})
    EXPECT_NE(scene.model.worldFromCamera(i).matrix(), before[i]) << i;
}

TEST(AdjustBundle, CostNeverRisesAndTheOptimumStays)
{
  LandmarkScene scene;
  scene.perturb();
  double last = std::numeric_limits<double>::infinity();
  BundleAdjustmentOptions options;
  options.max_iterations = 1;
  for (int k = 0; k < 6; ++k) {
    const BundleAdjustmentResult result =
        adjustBundle(scene.graph, scene.problem, options, scene.model);
    EXPECT_LE(result.final_cost, result.initial_cost);
    EXPECT_LE(result.initial_cost, last * (1 + 1e-9) + 1e-9);
    last = result.final_cost;
  }
  LandmarkScene exact;
  adjustBundle(exact.graph, exact.problem, {}, exact.model);
  EXPECT_LT(exact.largestPoseError(), 1e-6);
}

TEST(AdjustBundle, RelativePosesAlonePullPoses)
{
  LandmarkScene scene;
  SparseModel model(6);
  for (std::size_t i = 0; i < 6; ++i)
    model.registerFrame(i, scene.views[i].world_from_camera, 0); // no tracks
  model.setWorldFromCamera(1, randomMotion(1, 0.05, 0.1) * scene.views[1].world_from_camera);
  model.setWorldFromCamera(2, randomMotion(2, 0.05, 0.1) * scene.views[2].world_from_camera);
  BundleAdjustmentProblem problem;
  problem.variable = {0, 1, 2};
  for (std::size_t i = 0; i < 2; ++i) {
    RelativePoseTerm term;
    term.first = i;
    term.second = i + 1;
    term.first_from_second =
        scene.views[i].world_from_camera.inverse() * scene.views[i + 1].world_from_camera;
    term.information = 1e4 * Matrix6d::Identity();
    problem.relative_poses.push_back(term);
  }
  RelativePoseTerm ignored; // to a frame that takes no part
  ignored.first = 0;
  ignored.second = 5;
  ignored.information = 1e9 * Matrix6d::Identity();
  problem.relative_poses.push_back(ignored);
  const BundleAdjustmentResult result = adjustBundle(scene.graph, problem, {}, model);
  EXPECT_EQ(result.num_residuals, 12u);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT(
        logarithm(model.worldFromCamera(i) * scene.views[i].world_from_camera.inverse()).norm(),
        1e-4);
}

TEST(AdjustBundle, RefusesImagesWithoutAPose)
{
  LandmarkScene scene;
  scene.model.registerFrame(4, Pose::Identity(), -1);
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { adjustBundle(scene.graph, scene.problem, {}, scene.model); }),
                  "adjustBundle: frame 4 is not registered");
  scene.problem.variable = {0, 1};
  scene.problem.constant = {4};
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { adjustBundle(scene.graph, scene.problem, {}, scene.model); }),
                  "frame 4 is not registered");
}

TEST(AdjustBundle, NothingToMoveMovesNothing)
{
  LandmarkScene scene;
  for (const std::vector<std::size_t>& variable :
       {std::vector<std::size_t>{}, std::vector<std::size_t>{2}, std::vector<std::size_t>{2, 2}}) {
    scene.problem.variable = variable;
    const Pose before = scene.model.worldFromCamera(2);
    EXPECT_TRUE(adjustBundle(scene.graph, scene.problem, {}, scene.model).success);
    EXPECT_EQ(scene.model.worldFromCamera(2).matrix(), before.matrix());
  }
}

TEST(AdjustBundle, RefusesInvalidOptions)
{
  LandmarkScene scene;
  const auto message = [&](const BundleAdjustmentOptions& options) {
    return messageOf<pcl::BadArgumentException>(
        [&] { adjustBundle(scene.graph, scene.problem, options, scene.model); });
  };
  BundleAdjustmentOptions options;
  options.max_iterations = 0;
  EXPECT_CONTAINS(message(options), "adjustBundle: max_iterations must be >= 1");
  options = {};
  options.loss_scale = 0;
  EXPECT_CONTAINS(message(options), "loss_scale must be > 0");
  options = {};
  options.function_tolerance = 0;
  EXPECT_CONTAINS(message(options), "function_tolerance must be > 0");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
  options = {};
  options.depth_error_deviation = 0;
  EXPECT_CONTAINS(message(options), "depth_error_deviation must be > 0");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { heldBackCost(scene.graph, scene.problem, options, scene.model); }),
                  "heldBackCost: depth_error_deviation");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] {
                    calibrationDeviations(scene.graph, scene.problem, options, scene.model);
                  }),
                  "calibrationDeviations: depth_error_deviation");
}

TEST(AdjustBundle, DoesNotDependOnTheWorldFrame)
{
  LandmarkScene here, there;
  here.perturb();
  there.perturb();
  const Pose there_from_here = randomMotion(17, 1.2, 3);
  there.model.transform(0, there_from_here);
  adjustBundle(here.graph, here.problem, {}, here.model);
  adjustBundle(there.graph, there.problem, {}, there.model);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(logarithm(there_from_here * here.model.worldFromCamera(i) *
                        there.model.worldFromCamera(i).inverse())
                  .norm(),
              1e-5)
        << i;
}
