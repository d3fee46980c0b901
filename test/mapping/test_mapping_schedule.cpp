// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/scans.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <mutex>
#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Eight frames of the room, which all methods register. */
const Scan&
shortScan()
{
  static const Scan scan = [] {
    Scan s;
    s.addRoom({0, 4, 8, 12, 16, 20, 24, 28});
    return s;
  }();
  return scan;
}

const ImageGraph&
shortGraph()
{
  static const ImageGraph graph = shortScan().graph();
  return graph;
}

struct Mapped {
  SparseModel model;
  std::vector<Progress> progress;
  bool completed = false;
};

Mapped
mapped(const ImageGraph& graph, const Scan& scan, const MapperOptions& options = {})
{
  Mapped result;
  result.completed = IncrementalMapper(graph, scan.provider(), options)
                         .run(result.model, [&](const Progress& progress) {
                           result.progress.push_back(progress);
                           return true;
                         });
  return result;
}

} // namespace

TEST(MappingSchedule, ProgressGrowsToTheNumberOfImages)
{
  MapperOptions options;
  options.schedule.batch_size = 1;
  const Mapped one = mapped(shortGraph(), shortScan(), options),
               four = mapped(shortGraph(), shortScan());
  for (const Mapped* result : {&one, &four}) {
    EXPECT_TRUE(result->completed);
    std::size_t last = 2; // the first pair
    for (const Progress& progress : result->progress) {
      EXPECT_EQ(progress.stage, "registration");
      EXPECT_EQ(progress.total, 8u);
      EXPECT_GE(progress.done, last);
      EXPECT_LE(progress.done - last, result == &one ? 1u : 4u);
      last = progress.done;
    }
    EXPECT_EQ(last, 8u);
  }
  EXPECT_EQ(one.progress.size(), 6u); // one by one after the first pair
  EXPECT_LT(four.progress.size(), 6u);
}

TEST(MappingSchedule, BatchesAndAdjustmentsLeadToTheSamePlace)
{
  MapperOptions one_by_one, often;
  one_by_one.schedule.batch_size = 1;
  often.schedule.adjustment_growth = 1.01;
  for (const MapperOptions& options : {one_by_one, often, MapperOptions()}) {
    const Mapped result = mapped(shortGraph(), shortScan(), options);
    EXPECT_EQ(result.model.registeredFrames(0).size(), 8u);
    const PoseErrors errors = largestErrors(result.model, shortScan().truth, 0);
    EXPECT_LT(errors.distance, 0.002);
    EXPECT_LT(errors.angle, 0.1);
  }
}

TEST(MappingSchedule, OrderOfImagesDoesNotMatter)
{
  Scan backwards = shortScan();
  std::reverse(backwards.nodes.begin(), backwards.nodes.end());
  std::reverse(backwards.views.begin(), backwards.views.end());
  std::reverse(backwards.truth.begin(), backwards.truth.end());
  const Mapped there = mapped(backwards.graph(), backwards),
               here = mapped(shortGraph(), shortScan());
  ASSERT_EQ(there.model.registeredFrames(0).size(), 8u);
  // The poses of one run are compared with those of the other as if these were the truth.
  std::vector<Pose> others;
  for (std::size_t i = 0; i < 8; ++i)
    others.push_back(here.model.worldFromCamera(7 - i));
  const PoseErrors difference = largestErrors(there.model, others, 0);
  EXPECT_LT(difference.distance, 0.001);
  EXPECT_LT(difference.angle, 0.05);
}

TEST(MappingSchedule, StoppedAtOnceTheModelIsValidAndCanBeMadeAnew)
{
  IncrementalMapper stopped(shortGraph(), shortScan().provider());
  SparseModel model;
  std::size_t calls = 0;
  EXPECT_FALSE(stopped.run(model, [&](const Progress&) { return ++calls, false; }));
  EXPECT_EQ(calls, 1u); // never again after it asked to stop
  EXPECT_EQ(model.numFrames(), 8u);
  EXPECT_EQ(model.registeredFrames(0), model.registeredFrames());
  for (const ScenePoint& point : model.points())
    for (const Observation& o : point.track)
      EXPECT_TRUE(model.isRegistered(o.frame));
  SparseModel anew;
  EXPECT_TRUE(IncrementalMapper(shortGraph(), shortScan().provider()).run(anew));
  EXPECT_EQ(anew.registeredFrames(0).size(), 8u);
}

TEST(MappingSchedule, AsksForDepthOfRegisteredImagesAndTheNewOne)
{
  std::mutex mutex;
  std::set<std::size_t> asked;
  const DepthViewProvider views = [&](std::size_t frame, const SparseModel& model) {
    const std::lock_guard lock(mutex);
    EXPECT_LT(frame, 8u);
    EXPECT_EQ(model.numFrames(), 8u);
    asked.insert(frame);
    return shortScan().views[frame];
  };
  SparseModel model;
  EXPECT_TRUE(IncrementalMapper(shortGraph(), views).run(model));
  EXPECT_EQ(asked.size(), 8u);
  MapperOptions visual; // without dense terms depth images have no part at all
  visual.registration.method = FrameRegistrationMethod::VISUAL;
  visual.refinement.num_dense_neighbours = visual.refinement.num_exact_dense_neighbours = 0;
  asked.clear();
  SparseModel without;
  EXPECT_TRUE(IncrementalMapper(shortGraph(), views, visual).run(without));
  EXPECT_EQ(without.registeredFrames(0).size(), 8u);
  EXPECT_TRUE(asked.empty());
}

TEST(MapperOptions, EachPartIsCheckedAndSaysWhatIsWrong)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::pair<std::function<void(MapperOptions&)>, const char*> faults[] = {
      {[](auto& o) { o.num_threads = -2; }, "num_threads must be >= 0"},
      {[](auto& o) { o.schedule.batch_size = 0; }, "batch_size must be >= 1"},
      {[&](auto& o) { o.schedule.adjustment_growth = nan; }, "adjustment_growth must be > 1"},
      {[&](auto& o) { o.adjustment.loss_scale = nan; }, "loss_scale must be > 0"},
      {[](auto& o) { o.adjustment.num_threads = -1; }, "num_threads must be >= 0"},
      {[](auto& o) { o.registration.min_visual_inliers = 2; }, "min_visual_inliers must be >= 3"}};
  for (const auto& [fault, message] : faults) {
    MapperOptions options;
    std::string error = "as it was";
    EXPECT_TRUE(options.isValid(&error));
    EXPECT_EQ(error, "as it was");
    fault(options);
    EXPECT_FALSE(options.isValid()); // nobody wants to know why
    EXPECT_FALSE(options.isValid(&error));
    EXPECT_EQ(error, message);
  }
}
