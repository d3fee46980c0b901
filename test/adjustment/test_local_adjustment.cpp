// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/landmark_scene.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <map>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Frame 3 is off, the others are where they were taken. */
struct OneImageOff : LandmarkScene {
  OneImageOff()
  {
    model.setWorldFromCamera(3, randomMotion(1, 0.01, 0.02) * views[3].world_from_camera);
  }

  /** The other frames by the number of points that they share with frame 3, most first. */
  std::vector<std::size_t>
  ranked() const
  {
    std::map<std::size_t, std::size_t> shared;
    for (const ScenePoint& point : model.points())
      for (const Observation& a : point.track)
        for (const Observation& b : point.track)
          if (a.frame == 3 && b.frame != 3)
            ++shared[b.frame];
    std::vector<std::size_t> frames;
    for (const auto& [frame, points] : shared)
      frames.push_back(frame);
    std::sort(frames.begin(), frames.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(shared[a], a) > std::pair(shared[b], b);
    });
    return frames;
  }
};

} // namespace

TEST(AdjustLocally, BringsAnImageBackAndLeavesTheOthers)
{
  OneImageOff scene;
  std::vector<Pose> before;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    before.push_back(scene.model.worldFromCamera(i));
  const BundleAdjustmentResult result = adjustLocally(scene.graph, {3}, 10, {}, scene.model);
  EXPECT_TRUE(result.success);
  EXPECT_LT(result.final_cost, 1e-2 * result.initial_cost);
  EXPECT_LT(scene.largestPoseError(), 1e-4);
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    EXPECT_EQ(scene.model.worldFromCamera(i).matrix() == before[i].matrix(), i != 3) << i;
}

TEST(AdjustLocally, MovesThePointsThatItsImagesSee)
{
  OneImageOff scene;
  scene.perturb();
  const std::vector<ScenePoint> before = scene.model.points();
  adjustLocally(scene.graph, {3}, 10, {}, scene.model);
  std::size_t seen = 0;
  for (std::size_t p = 0; p < before.size(); ++p) {
    bool sees = false;
    for (const Observation& o : before[p].track)
      sees |= o.frame == 3;
    seen += sees;
    EXPECT_EQ(scene.model.points()[p].position != before[p].position, sees) << p;
  }
  EXPECT_GT(seen, 0u);
  EXPECT_LT(seen, before.size());
}

TEST(AdjustLocally, IsHeldByTheImagesThatShareMostPoints)
{
  for (const std::size_t num_held : {1, 2, 4}) {
    OneImageOff local, explicitly;
    const BundleAdjustmentResult a = adjustLocally(local.graph, {3}, num_held, {}, local.model);
    explicitly.problem.variable = {3};
    explicitly.problem.constant = explicitly.ranked();
    ASSERT_EQ(explicitly.problem.constant.size(), 5u);
    explicitly.problem.constant.resize(num_held);
    const BundleAdjustmentResult b =
        adjustBundle(explicitly.graph, explicitly.problem, {}, explicitly.model);
    EXPECT_EQ(a.num_residuals, b.num_residuals);
    EXPECT_EQ(a.final_cost, b.final_cost);
    EXPECT_EQ(local.model.worldFromCamera(3).matrix(),
              explicitly.model.worldFromCamera(3).matrix());
  }
}

TEST(AdjustLocally, WithoutAnImageToHoldItNothingHappens)
{
  OneImageOff scene;
  const Pose before = scene.model.worldFromCamera(3);
  const auto expectNothing = [&](const BundleAdjustmentResult& result) {
    EXPECT_FALSE(result.success);
    EXPECT_EQ(result.num_residuals, 0u);
    EXPECT_EQ(scene.model.worldFromCamera(3).matrix(), before.matrix());
  };
  expectNothing(adjustLocally(scene.graph, {3}, 0, {}, scene.model));
  expectNothing(adjustLocally(scene.graph, {}, 10, {}, scene.model));
  expectNothing(adjustLocally(scene.graph, {0, 1, 2, 3, 4, 5}, 10, {}, scene.model));
  scene.model = SparseModel(6);
  scene.model.registerFrame(3, before, 0); // no tracks
  expectNothing(adjustLocally(scene.graph, {3}, 10, {}, scene.model));
}

TEST(AdjustLocally, RefusesInvalidOptions)
{
  OneImageOff scene;
  BundleAdjustmentOptions options;
  options.max_iterations = 0;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { adjustLocally(scene.graph, {3}, 10, options, scene.model); }),
                  "adjustBundle: max_iterations must be >= 1");
}
