// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/residuals.h"

#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Largest pose error after an adjustment of exact views, of which one feature of frame 2 lies
 *  `pixels` off. */
double
errorByAnOutlier(float pixels, double loss_scale, AdjustmentSolver solver)
{
  LandmarkScene scene;
  std::vector<LandmarkView> views = scene.views;
  const int feature = [&] {
    for (const ScenePoint& point : scene.model.points())
      for (const Observation& o : point.track)
        if (o.frame == 2 && point.track.size() == scene.views.size())
          return o.feature;
    return 0;
  }();
  views[2].features.pixels[std::size_t(feature)].x() += pixels;
  views[2].features.depths[std::size_t(feature)] = 0; // its depth has no part in this
  const ImageGraph graph = toGraph(scene.landmarks, views);
  BundleAdjustmentOptions options;
  options.loss_scale = loss_scale;
  options.solver = solver;
  options.function_tolerance = 1e-9;
  EXPECT_TRUE(adjustBundle(graph, scene.problem, options, scene.model).success);
  return scene.largestPoseError();
}

} // namespace

TEST(RobustLoss, IsTheSquareOfSmallErrors)
{
  for (const double scale : {0.5, 2.0, 10.0}) {
    EXPECT_EQ(robustCost(0, scale), 0);
    EXPECT_EQ(robustWeight(0, scale), 1);
    const double small = 1e-6 * scale * scale;
    EXPECT_NEAR(robustCost(small, scale) / small, 1, 1e-6);
  }
}

TEST(RobustLoss, AnErrorOfItsScaleCountsHalf)
{
  for (const double scale : {0.5, 2.0, 10.0}) {
    EXPECT_DOUBLE_EQ(robustWeight(scale * scale, scale), 0.5);
    EXPECT_DOUBLE_EQ(robustCost(scale * scale, scale), scale * scale * std::log(2.0));
  }
}

TEST(RobustLoss, ItsWeightIsTheSlopeOfItsCost)
{
  for (const double scale : {0.5, 2.0})
    for (const double squared : {0.01, 1.0, 7.0, 400.0}) {
      const double step = 1e-5 * squared;
      const double slope =
          (robustCost(squared + step, scale) - robustCost(squared - step, scale)) / (2 * step);
      EXPECT_NEAR(robustWeight(squared, scale), slope, 1e-6 * slope);
    }
}

TEST(RobustLoss, TheFartherAnErrorTheLessItPulls)
{
  // The pull of an error r is r times its weight: largest at the scale, then falling to nothing.
  const double scale = 2;
  const auto pull = [&](double error) { return error * robustWeight(error * error, scale); };
  for (const double error : {0.5, 1.0, 1.9})
    EXPECT_GT(pull(error + 0.1), pull(error));
  for (const double error : {2.0, 5.0, 100.0})
    EXPECT_LT(pull(1.1 * error), pull(error));
  EXPECT_DOUBLE_EQ(pull(scale), scale / 2);
}

TEST(RobustLoss, AgreesWithThatOfCeres)
{
  for (const double scale : {0.5, 2.0})
    for (const double squared : {0.0, 0.3, 50.0}) {
      double rho[3];
      ceres::CauchyLoss(scale).Evaluate(squared, rho);
      EXPECT_NEAR(robustCost(squared, scale), rho[0], 1e-12 * (1 + rho[0]));
      EXPECT_NEAR(robustWeight(squared, scale), rho[1], 1e-12);
    }
}

TEST(RobustLoss, AFalsePixelHardlyMovesAPose)
{
  for (const AdjustmentSolver solver : SOLVERS) {
    const double robust = errorByAnOutlier(60, 2, solver);
    const double squared = errorByAnOutlier(60, 1e6, solver);
    EXPECT_GT(squared, 1e-3);
    EXPECT_LT(robust, 0.02 * squared);
    // Twice as far it pulls twice as much, or half as much.
    EXPECT_NEAR(errorByAnOutlier(120, 1e6, solver), 2 * squared, 0.2 * squared);
    EXPECT_LT(errorByAnOutlier(120, 2, solver), robust);
  }
}
