// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "scan/frames.h"
#include "temporary_folder.h"

#include <bundle_icp/io/joined_dataset.h>

#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <map>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const FrameReport&
reportOf(const ReconstructionResult& result, std::size_t id)
{
  for (const FrameReport& frame : result.frames)
    if (frame.id == id)
      return frame;
  throw std::runtime_error("no such frame");
}

/** Poses that hold for every frame of both results have to be the same. */
void
expectSamePoses(const ReconstructionResult& a, const ReconstructionResult& b, double tolerance)
{
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (const FrameReport& frame : a.frames) {
    const FrameReport& other = reportOf(b, frame.id);
    EXPECT_EQ(frame.registered, other.registered) << frame.id;
    EXPECT_LE(
        (frame.world_from_camera.matrix() - other.world_from_camera.matrix()).cwiseAbs().maxCoeff(),
        tolerance)
        << frame.id;
  }
}

} // namespace

TEST(Reconstruct, FindsTheTruePoses)
{
  const ReconstructionResult& result = reference();
  EXPECT_EQ(result.status, ReconstructionStatus::COMPLETED);
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{8});
  EXPECT_LT(largestError(result), 0.005);
  EXPECT_EQ(result.frames.front().world_from_camera.matrix(), Pose::Identity().matrix());
  const Trajectory trajectory = result.trajectory();
  ASSERT_EQ(trajectory.size(), 8u);
  for (std::size_t k = 1; k < trajectory.size(); ++k)
    EXPECT_LT(trajectory[k - 1].timestamp, trajectory[k].timestamp);
  EXPECT_TRUE(result.trajectory(1).empty());
  for (const FrameReport& frame : result.frames) {
    EXPECT_TRUE(frame.registered);
    EXPECT_EQ(frame.component, 0);
    EXPECT_EQ(frame.reason, "");
    EXPECT_GT(frame.features, 100u);
    EXPECT_EQ(frame.name, "frame " + std::to_string(frame.id));
    EXPECT_EQ(frame.verdict, FrameVerdict::GOOD) << frame.doubt;
    EXPECT_GT(frame.depth_agreement, 0.9);
  }
  EXPECT_EQ(result.verdict(), Verdict::GOOD);
  EXPECT_GT(result.peak_memory_bytes, 0u);
}

TEST(Reconstruct, DoesNotDependOnThreadsNorOnTheRun)
{
  for (const int threads : {1, 2}) {
    ReconstructionOptions options = withoutMesh();
    options.num_threads = threads;
    expectSamePoses(reconstruct(Frames(everyFourth()), options), reference(), 0);
  }
}

TEST(Reconstruct, DoesNotDependOnTheOrderOfFrames)
{
  std::vector<std::size_t> shuffled{20, 4, 28, 0, 12, 24, 16, 8};
  expectSamePoses(reconstruct(Frames(shuffled), withoutMesh()), reference(), 1e-4);
}

TEST(Reconstruct, DoesNotDependOnTheUnitOfDepth)
{
  const TemporaryFolder folder;
  SyntheticScanOptions options;
  options.num_frames = 8;
  options.frame_rate = 2.5;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262.5;
  SyntheticScanWriteOptions no_surface;
  no_surface.surface_spacing = 0;
  const std::string scan = folder.path("scan"), depth = scan + "/depth";
  writeSyntheticScan(SyntheticScan(options), scan, no_surface);
  const auto poses = [&](double units) {
    DatasetOptions recording;
    recording.depth_scale = units;
    return reconstruct(*openDataset(scan, recording), withoutMesh());
  };
  const ReconstructionResult before = poses(5000);
  for (const auto& entry : boost::filesystem::directory_iterator(depth)) {
    const std::string file = entry.path().string();
    cv::imwrite(file, 2 * cv::imread(file, cv::IMREAD_UNCHANGED));
  }
  expectSamePoses(poses(10000), before, 0);
  EXPECT_EQ(before.component_sizes, std::vector<std::size_t>{8});
}

TEST(Reconstruct, EveryMethodOnTheSamePreparedScan)
{
  const Frames frames({0, 1, 2, 3, 4, 5, 6, 8}, {3});
  PreparedScan scan(frames, withoutMesh());
  std::map<std::string, std::vector<std::string>> stages;
  for (const ReconstructionMethod method :
       {ReconstructionMethod::BUNDLE_ICP, ReconstructionMethod::VISUAL_ICP,
        ReconstructionMethod::RGBD_SFM, ReconstructionMethod::F2M_ICP}) {
    const std::string name = toString(method);
    EXPECT_EQ(parseReconstructionMethod(name), method);
    ReconstructionOptions options = withoutMesh();
    options.method = method;
    const ReconstructionResult result = reconstruct(scan, options);
    EXPECT_EQ(result.status, ReconstructionStatus::COMPLETED) << name;
    const bool is_verified =
        method == ReconstructionMethod::BUNDLE_ICP || method == ReconstructionMethod::RGBD_SFM;
    EXPECT_EQ(result.verdict(), is_verified ? Verdict::GOOD : Verdict::USABLE) << name;
    EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{7}) << name;
    EXPECT_LT(largestError(result), 0.005) << name;
    EXPECT_CONTAINS(reportOf(result, 3).reason, "is truncated");
    EXPECT_FALSE(reportOf(result, 3).registered) << name;
    if (result.graph) { // others may follow that need them
      EXPECT_FALSE(result.graph->features(0).descriptors.empty()) << name;
    }
    for (const auto& [stage, seconds] : result.timing_s) {
      stages[name].push_back(stage);
      EXPECT_GT(seconds, 0) << name << ": " << stage;
    }
  }
  const std::vector<std::string> all{"check", "features", "matching", "registration",
                                     "verification"};
  EXPECT_EQ(stages["bundle_icp"], all);
  EXPECT_EQ(stages["rgbd_sfm"], all);
  EXPECT_EQ(stages["visual_icp"], (std::vector<std::string>{"check", "features", "tracking"}));
  EXPECT_EQ(stages["f2m_icp"], (std::vector<std::string>{"check", "tracking"}));
  EXPECT_FALSE(parseReconstructionMethod("slam"));
}

TEST(Reconstruct, TrackingMethodsGiveAMeshAndTakeTheGivenOrder)
{
  ReconstructionOptions options;
  options.method = ReconstructionMethod::F2M_ICP;
  options.volume.voxel_size = 0.02;
  options.volume.truncation = 0.08;
  const Frames frames({0, 1, 2, 3});
  const ReconstructionResult result = reconstruct(frames, options);
  EXPECT_GT(result.mesh.polygons.size(), 1000u);
  EXPECT_FALSE(result.graph);
  const TemporaryFolder folder;
  writeReconstruction(folder.path("out"), frames, options, result);
  EXPECT_EQ(readTrajectory(folder.path("out/trajectory.txt")).size(), 4u);
  EXPECT_CONTAINS(readText(folder.path("out/report.json")), "f2m_icp");

  const ReconstructionResult single = reconstruct(Frames({0, 4}, {4}), options);
  EXPECT_EQ(single.status, ReconstructionStatus::NOTHING_REGISTERED);
  EXPECT_CONTAINS(single.frames[0].reason, "no other frame could be aligned with it");
}

TEST(Reconstruct, SkipsAndNamesFramesThatCannotBeRead)
{
  const ReconstructionResult result = reconstruct(Frames(everyFourth(), {8, 20}), withoutMesh());
  EXPECT_EQ(result.status, ReconstructionStatus::COMPLETED);
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{6});
  EXPECT_LT(largestError(result), 0.005);
  for (const std::size_t bad : {8, 20}) {
    const FrameReport& frame = reportOf(result, bad);
    EXPECT_FALSE(frame.registered);
    EXPECT_EQ(frame.component, -1);
    EXPECT_CONTAINS(frame.reason, "frame " + std::to_string(bad) + ".png is truncated");
  }
  EXPECT_EQ(result.graph->size(), 6u);
  EXPECT_TRUE(result.graph->features(0).descriptors.empty());
}

TEST(Reconstruct, SaysWhyTheSurfaceIsEmpty)
{
  ReconstructionOptions options;
  options.volume.min_depth = 0.05;
  options.volume.max_depth = 0.1;
  const ReconstructionResult result = reconstruct(Frames(everyFourth()), options);
  EXPECT_EQ(result.verdict(), Verdict::DOUBTFUL);
  ASSERT_FALSE(result.findings.empty());
  EXPECT_EQ(result.findings.back().kind, "empty_surface");
  EXPECT_CONTAINS(result.findings.back().what, "hardly any depth lies between 0.05 and 0.1 m");
}

TEST(Reconstruct, SaysOfEachFrameWhyNothingWasRegistered)
{
  // Not a frame can be read.
  const ReconstructionResult unreadable = reconstruct(Frames({0, 4}, {0, 4}), withoutMesh());
  EXPECT_EQ(unreadable.status, ReconstructionStatus::NOTHING_REGISTERED);
  EXPECT_CONTAINS(unreadable.frames[1].reason, "is truncated");
  // A single frame has nothing in common with another.
  const ReconstructionResult single = reconstruct(Frames({0, 4}, {4}), withoutMesh());
  EXPECT_EQ(single.status, ReconstructionStatus::NOTHING_REGISTERED);
  EXPECT_CONTAINS(single.frames[0].reason, "no other image shares 15 verified matches");
  EXPECT_TRUE(single.component_sizes.empty());
  EXPECT_TRUE(single.trajectory().empty());
  ReconstructionOptions options = withoutMesh();
  options.graph.matching.min_matches = 100000; // more than there are
  const ReconstructionResult apart = reconstruct(Frames(everyFourth()), options);
  EXPECT_EQ(apart.status, ReconstructionStatus::NOTHING_REGISTERED);
  for (const FrameReport& frame : apart.frames)
    EXPECT_CONTAINS(frame.reason, "no other image shares 100000");
}

TEST(Reconstruct, StopsInEachStageWhenAsked)
{
  for (const std::string stage : {"features", "matching", "registration", "surface"}) {
    ReconstructionOptions options;
    options.num_threads = 1;
    options.volume.voxel_size = 0.02;
    options.volume.truncation = 0.08;
    bool stopped = false;
    const ReconstructionResult result =
        reconstruct(Frames({0, 4, 8, 12}), options, [&](const Progress& progress) {
          EXPECT_FALSE(stopped) << "called after it asked to stop";
          EXPECT_LE(progress.done, progress.total);
          stopped = progress.stage == stage;
          return !stopped;
        });
    EXPECT_TRUE(stopped) << stage;
    EXPECT_EQ(result.status, ReconstructionStatus::STOPPED) << stage;
    EXPECT_EQ(result.verdict(), Verdict::DOUBTFUL) << stage;
    for (const FrameReport& frame : result.frames)
      EXPECT_EQ(frame.verdict == FrameVerdict::LEFT_OUT, !frame.registered) << stage;
    EXPECT_EQ(result.frames.size(), 4u);
    EXPECT_EQ(result.timing_s.back().first, stage);
  }
}

TEST(Reconstruct, RefusesInvalidOptionsAndEmptyDatasets)
{
  const auto message = [](const ReconstructionOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { reconstruct(Frames({0}), options); });
  };
  ReconstructionOptions options;
  options.depth_reduction = 9;
  EXPECT_CONTAINS(message(options), "reconstruct: depth_reduction must lie in 1 ... 8");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
  options = {};
  options.features.max_features = 0;
  EXPECT_CONTAINS(message(options), "max_features");
  options = {};
  options.graph.matching.ratio = 0;
  EXPECT_CONTAINS(message(options), "ratio");
  options = {};
  options.mapper.registration.min_overlap = 2;
  EXPECT_CONTAINS(message(options), "min_overlap");
  options = {};
  options.tracking.min_overlap = 0;
  EXPECT_CONTAINS(message(options), "min_overlap");
  options = {};
  options.volume.voxel_size = 0;
  EXPECT_CONTAINS(message(options), "voxel_size");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] { reconstruct(Frames({})); }),
                  "reconstruct: the dataset has no frames");
}

TEST(Reconstruct, RecordingsOfOnePlaceBecomeOneScan)
{
  const auto evens = std::make_shared<Frames>(std::vector<std::size_t>{0, 8, 16, 24});
  const auto odds = std::make_shared<Frames>(std::vector<std::size_t>{4, 12, 20, 28});
  const ReconstructionResult result = reconstruct(JoinedDataset({evens, odds}), withoutMesh());
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{8});
  EXPECT_LT(largestError(result), 0.005);
}
