// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST(AdjustBundle, SolversReachTheSameCost)
{
  using Change = void (*)(NoisyScene&);
  const Change changes[] = {[](NoisyScene&) {},
                            [](NoisyScene& scene) { scene.problem.depth_errors = true; },
                            [](NoisyScene& scene) {
                              scene.problem.constant = {0, 2};
                              scene.problem.variable = {1, 3, 4};
                            },
                            complicate};
  for (const unsigned num_frames : {6, 70}) // dense and sparse factorisations of Ceres
    for (const Change change : changes) {
      if (num_frames > 6 && change != changes[3])
        continue;
      BundleAdjustmentResult results[2];
      for (int k = 0; k < 2; ++k) {
        NoisyScene scene(num_frames);
        change(scene);
        BundleAdjustmentOptions options;
        options.solver = SOLVERS[k];
        options.function_tolerance = 1e-12;
        options.max_iterations = 100;
        results[k] = adjustBundle(scene.graph, scene.problem, options, scene.model);
        EXPECT_TRUE(results[k].success);
      }
      const BundleAdjustmentResult &own = results[0], &ceres = results[1];
      EXPECT_EQ(own.num_residuals, ceres.num_residuals);
      EXPECT_NEAR(own.initial_cost, ceres.initial_cost, 1e-9 * ceres.initial_cost);
      EXPECT_GT(own.initial_cost, 2 * own.final_cost);
      EXPECT_NEAR(own.final_cost, ceres.final_cost, 1e-6 * ceres.final_cost) << num_frames;
    }
}

TEST(AdjustBundle, DoesNotDependOnThreads)
{
  const auto adjusted = [](AdjustmentSolver solver, int num_threads) {
    NoisyScene scene(30);
    complicate(scene);
    BundleAdjustmentOptions options;
    options.solver = solver;
    options.num_threads = num_threads;
    EXPECT_TRUE(adjustBundle(scene.graph, scene.problem, options, scene.model).success);
    return scene.model;
  };
  for (const AdjustmentSolver solver : SOLVERS) {
    const SparseModel one = adjusted(solver, 1);
    for (const int num_threads : {2, 3}) {
      const SparseModel other = adjusted(solver, num_threads);
      EXPECT_EQ(one.calibration().values, other.calibration().values);
      for (std::size_t i = 0; i < one.numFrames(); ++i) {
        EXPECT_EQ(one.worldFromCamera(i).matrix(), other.worldFromCamera(i).matrix());
        EXPECT_EQ(one.depthError(i), other.depthError(i));
      }
      for (std::size_t p = 0; p < one.points().size(); ++p)
        EXPECT_EQ(one.points()[p].position, other.points()[p].position);
    }
  }
}

TEST(AdjustBundle, IsTheSameFromRunToRun)
{
  LandmarkScene a, b;
  a.perturb();
  b.perturb();
  adjustBundle(a.graph, a.problem, {}, a.model);
  adjustBundle(b.graph, b.problem, {}, b.model);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(a.model.worldFromCamera(i).matrix(), b.model.worldFromCamera(i).matrix());
}
