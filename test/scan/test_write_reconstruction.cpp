// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "scan/frames.h"
#include "temporary_folder.h"

#include <nlohmann/json.hpp>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST(WriteReconstruction, WritesAllFilesAndTheReport)
{
  const Frames frames(everyFourth(), {8});
  ReconstructionOptions options;
  options.volume.voxel_size = 0.02;
  options.volume.truncation = 0.08;
  ReconstructionResult result = reconstruct(frames, options);
  result.frames[1].depth_error << 0.5, -1, 2;
  const TemporaryFolder folder;
  writeReconstruction(folder.path("new/out"), frames, options, result);
  for (const char* file : {"trajectory.txt", "sparse.ply", "mesh.ply", "mesh.png", "trajectory.png",
                           "calibration.json", "report.json"})
    EXPECT_GT(readText(folder.path("new/out/") + file).size(), 100u) << file;
  EXPECT_GT(result.mesh.polygons.size(), 1000u);
  EXPECT_EQ(readTrajectory(folder.path("new/out/trajectory.txt")).size(), 7u);

  const auto report = nlohmann::json::parse(readText(folder.path("new/out/report.json")));
  EXPECT_EQ(report["verdict"], "good");
  EXPECT_EQ(report["findings"][0]["kind"], "units");
  EXPECT_EQ(report["findings"].back()["kind"], "scene");
  EXPECT_EQ(report["frames"][0]["verdict"], "good");
  EXPECT_EQ(report["frames"][2]["verdict"], "left out");
  for (const char* key : {"version", "frames", "components", "timing_s", "peak_memory_bytes",
                          "calibration", "options"})
    EXPECT_TRUE(report.contains(key)) << key;
  ASSERT_EQ(report["frames"].size(), 8u);
  for (const auto& frame : report["frames"]) {
    for (const char* key : {"id", "timestamp", "registered", "matches", "inliers", "icp_rmse"})
      EXPECT_TRUE(frame.contains(key)) << key;
    EXPECT_EQ(frame["registered"].get<bool>(), frame["id"] != 8);
    EXPECT_EQ(frame.contains("reason"), frame["id"] == 8);
  }
  EXPECT_EQ(report["frames"][1]["depth_error"], nlohmann::json({0.5, -1, 2}));
  EXPECT_FALSE(report["frames"][0].contains("depth_error"));
  EXPECT_EQ(report["components"][0]["frames"], 7);
  for (const char* stage : {"features", "matching", "registration", "surface"})
    EXPECT_TRUE(report["timing_s"].contains(stage)) << stage;
}

TEST(WriteReconstruction, AFailureStillGetsAReport)
{
  const Frames frames({0, 4}, {4});
  const ReconstructionResult result = reconstruct(frames, withoutMesh());
  const TemporaryFolder folder;
  writeReconstruction(folder.path(), frames, withoutMesh(), result);
  const auto report = nlohmann::json::parse(readText(folder.path("report.json")));
  EXPECT_TRUE(report["components"].empty());
  EXPECT_CONTAINS(report["frames"][1]["reason"].get<std::string>(), "is truncated");
  EXPECT_EQ(readText(folder.path("trajectory.txt")), "");
}

TEST(WriteReconstruction, LeavesNoFileOfAnEarlierResult)
{
  const TemporaryFolder folder;
  for (const char* file : {"mesh.ply", "mesh.obj", "mesh.png", "notes.txt"})
    writeText(folder.path(file), "earlier");
  writeReconstruction(folder.path(), Frames(everyFourth()), withoutMesh(), reference());
  for (const char* file : {"mesh.ply", "mesh.obj", "mesh.png"})
    EXPECT_FALSE(boost::filesystem::exists(folder.path(file))) << file;
  EXPECT_EQ(readText(folder.path("notes.txt")), "earlier");
}

TEST(WriteReconstruction, NamesTheFolderThatCannotBeMade)
{
  const TemporaryFolder folder;
  writeText(folder.path("file"), "not a folder");
  const std::string path = folder.path("file/out");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] {
                    writeReconstruction(path, Frames(everyFourth()), withoutMesh(), reference());
                  }),
                  path);
}
