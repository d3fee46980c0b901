// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/held_back.h"
#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST(HeldBack, IsAFifthOfLongTracks)
{
  int held = 0, all = 0;
  for (std::size_t length = 1; length < 12; ++length)
    for (int feature = 0; feature < 10; ++feature) {
      ScenePoint point;
      for (std::size_t k = 0; k < length; ++k)
        point.track.push_back({k, k == 0 ? feature : 3});
      for (std::size_t k = 0; k < length; ++k)
        if (length < 4) {
          EXPECT_FALSE(isHeldBack(point, k));
        }
        else {
          held += isHeldBack(point, k);
          ++all;
        }
    }
  EXPECT_EQ(5 * held, all);
}

TEST(HeldBack, ObservationsTakeNoPart)
{
  LandmarkScene scene;
  std::size_t held = 0, all = 0;
  for (const ScenePoint& point : scene.model.points())
    for (std::size_t k = 0; k < point.track.size(); ++k) {
      held += isHeldBack(point, k);
      ++all;
    }
  ASSERT_GT(held, 50u);
  EXPECT_EQ(adjustBundle(scene.graph, scene.problem, {}, scene.model).num_residuals, 3 * all);
  scene.problem.hold_back = true;
  EXPECT_EQ(adjustBundle(scene.graph, scene.problem, {}, scene.model).num_residuals,
            3 * (all - held));
}

TEST(HeldBack, CostIsThatOfEachVariableImage)
{
  LandmarkScene scene;
  scene.problem.hold_back = true;
  scene.problem.variable = {4, 1, 2};
  scene.problem.constant = {0, 3, 5};
  const BundleAdjustmentOptions options;
  const auto cost = [&] { return heldBackCost(scene.graph, scene.problem, options, scene.model); };
  ASSERT_EQ(cost().size(), 3u);
  for (const double exact : cost())
    EXPECT_LT(exact, 1e-2);
  scene.model.setWorldFromCamera(1, randomMotion(1, 0.01, 0.01) * scene.model.worldFromCamera(1));
  EXPECT_LT(cost()[0], 1e-2);
  EXPECT_GT(cost()[1], 1);
  EXPECT_LT(cost()[2], 1e-2);
}

TEST(HeldBack, CostOfOneObservationByHand)
{
  LandmarkScene scene;
  scene.problem.hold_back = true;
  const std::vector<double> before = heldBackCost(scene.graph, scene.problem, {}, scene.model);
  // Depth errors of three sigma in frame 2 alone
  scene.model.setDepthError(2, {3, 0, 0});
  std::size_t held = 0;
  for (const ScenePoint& point : scene.model.points())
    for (std::size_t k = 0; k < point.track.size(); ++k)
      held += point.track[k].frame == 2 && isHeldBack(point, k);
  ASSERT_GT(held, 5u);
  const std::vector<double> after = heldBackCost(scene.graph, scene.problem, {}, scene.model);
  const double robust = 4 * std::log1p(9.0 / 4); // Cauchy at a scale of 2
  EXPECT_NEAR(after[2] - before[2], robust * double(held), 1e-2 * double(held));
  EXPECT_EQ(after[1], before[1]);
}
