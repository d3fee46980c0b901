// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_reconstruct --live on a simulated scan.
#include <bundle_icp/io/trajectory.h>

#include "messages.h"
#include "results.h"

#include <regex>

using namespace bundle_icp;

namespace {

using ReconstructLive = ReconstructProgram;

} // namespace

TEST_F(ReconstructLive, PlaysTheScanAndWritesPosesAsTheyWereKnown)
{
  simulate();
  const ProgramResult result = reconstruct({"--live", "--no-mesh"});
  ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 3) << result.err; // 3: many were dropped
  std::smatch figures;
  ASSERT_TRUE(std::regex_search(result.out, figures,
                                std::regex("live: (\\d+) frames played, (\\d+) dropped, (\\d+) "
                                           "lost, (\\d+) doubtful; [\\d.]+ ms a frame")))
      << result.out;
  const std::size_t played = std::stoul(figures[1]), dropped = std::stoul(figures[2]);
  EXPECT_EQ(played + dropped, 12u);
  const Trajectory live = readTrajectory(out + "/trajectory_live.txt");
  EXPECT_EQ(live.size(), played - std::stoul(figures[3]) - std::stoul(figures[4]));
  EXPECT_TRUE(live.front().world_from_camera.isApprox(Pose::Identity(), 1e-6));
  const nlohmann::json json = report();
  ASSERT_EQ(json["frames"].size(), played);
  const Trajectory truth = readTrajectory(scan + "/groundtruth.txt");
  for (const auto& frame : json["frames"]) // each keeps its number in the recording
    EXPECT_NEAR(double(frame["timestamp"]), truth[std::size_t(frame["id"])].timestamp, 1e-3);

  ASSERT_EQ(reconstruct({"--no-mesh"}).exit_code, 0);
  EXPECT_EQ(namesIn(out).count("trajectory_live.txt"), 0u);
}

TEST_F(ReconstructLive, RefusesWhatNobodyScansBy)
{
  const auto error = [this](const std::vector<std::string>& options) {
    std::vector<std::string> arguments{scan, "-o", out, "--live"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProgramResult result = runProgram("bundle_icp_reconstruct", arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  EXPECT_CONTAINS(error({folder.path("other")}), "--live: only with one SCAN");
  EXPECT_CONTAINS(error({"--method", "rgbd_sfm"}), "--live: only with --method bundle_icp");
  EXPECT_CONTAINS(error({"--moving", "object"}), "--live: only with --moving camera");
  EXPECT_CONTAINS(error({"--shuffle", "1"}), "--live: not with --shuffle");
}
