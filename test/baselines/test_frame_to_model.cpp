// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "registration/scenes.h"

#include <bundle_icp/baselines/frame_to_model.h>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Frames of the room(), rendered once per program. */
const RGBDFrame&
frameOfRoom(std::size_t index)
{
  static std::vector<RGBDFrame> frames(room().size());
  if (frames[index].depth.empty())
    frames[index] = room().read(index);
  return frames[index];
}

Pose
truth(std::size_t first, std::size_t index)
{
  return room().worldFromCamera(first).inverse() * room().worldFromCamera(index);
}

void
expectAt(const FrameRegistration& frame, const Pose& expected)
{
  ASSERT_TRUE(frame.registered) << frame.reason;
  const Pose error = expected.inverse() * frame.world_from_camera;
  EXPECT_LT(error.translation().norm(), 0.005); // half a voxel of the model
  EXPECT_LT(degrees(rotationAngle(error)), 0.2);
}

} // namespace

TEST(FrameToModelTracker, FollowsASlowScan)
{
  FrameToModelTracker tracker(room().camera());
  for (std::size_t i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    const FrameRegistration frame = tracker.track(frameOfRoom(i));
    expectAt(frame, truth(0, i));
    EXPECT_EQ(frame.matches, 0u);
    EXPECT_GT(frame.overlap, 0.7);
    EXPECT_LT(frame.icp_rmse, 0.01);
  }
  EXPECT_GT(tracker.volume().numBlocks(), 1000u);
}

TEST(FrameToModelTracker, FeaturesBridgeALargeMotion)
{
  constexpr std::size_t last = 32; // 44 cm and 7 degrees away
  FrameToModelTracker by_depth(room().camera()), visual(room().camera());
  by_depth.track(frameOfRoom(0));
  visual.track(frameOfRoom(0), extractFeatures(frameOfRoom(0), room().camera()));
  const FrameRegistration found =
      visual.track(frameOfRoom(last), extractFeatures(frameOfRoom(last), room().camera()));
  expectAt(found, truth(0, last));
  EXPECT_GE(found.matches, found.inliers);
  EXPECT_GE(found.inliers, 15u);
  const FrameRegistration alone = by_depth.track(frameOfRoom(last));
  EXPECT_FALSE(alone.registered &&
               (alone.world_from_camera.inverse() * truth(0, last)).translation().norm() < 0.05);
}

TEST(FrameToModelTracker, ALostFrameSaysWhyAndTheNextIsTracked)
{
  FrameToModelTracker tracker(room().camera());
  for (std::size_t i = 0; i < 3; ++i)
    tracker.track(frameOfRoom(i));
  const std::size_t blocks = tracker.volume().numBlocks();

  RGBDFrame blind = frameOfRoom(3);
  blind.depth = cv::Mat(blind.depth.size(), CV_32FC1, cv::Scalar(NAN));
  EXPECT_CONTAINS(tracker.track(blind).reason, "hardly any depth was measured");

  RGBDFrame elsewhere = frameOfRoom(3);
  cv::flip(elsewhere.depth, elsewhere.depth, -1); // by half a turn
  const FrameRegistration lost = tracker.track(elsewhere);
  EXPECT_FALSE(lost.registered);
  EXPECT_CONTAINS(lost.reason, "% of the depth lies on the model");
  EXPECT_EQ(tracker.volume().numBlocks(), blocks); // nothing false was fused
  expectAt(tracker.track(frameOfRoom(4)), truth(0, 4));
}

TEST(FrameToModelTracker, DoesNotDependOnThreads)
{
  Pose poses[2];
  for (const int threads : {1, 2}) {
    TrackingOptions options;
    options.num_threads = threads;
    FrameToModelTracker tracker(room().camera(), options);
    for (std::size_t i = 0; i < 6; i += 2)
      poses[threads - 1] = tracker.track(frameOfRoom(i)).world_from_camera;
  }
  EXPECT_EQ(poses[0].matrix(), poses[1].matrix());
}

TEST(FrameToModelTracker, RefusesInvalidOptions)
{
  const auto message = [](const TrackingOptions& options) {
    return messageOf<pcl::BadArgumentException>(
        [&] { FrameToModelTracker(room().camera(), options); });
  };
  TrackingOptions options;
  options.depth_reduction = 0;
  EXPECT_CONTAINS(message(options), "FrameToModelTracker: depth_reduction must lie in 1 ... 8");
  options = {};
  options.min_overlap = 1.1;
  EXPECT_CONTAINS(message(options), "min_overlap and min_overlap_with_features must lie");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
  options = {};
  options.volume.voxel_size = 0;
  EXPECT_CONTAINS(message(options), "voxel_size");
  options = {};
  options.matching.ratio = 0;
  EXPECT_CONTAINS(message(options), "ratio");
}
