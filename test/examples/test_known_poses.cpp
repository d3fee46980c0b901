// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_reconstruct with poses that are known beforehand.
#include "messages.h"
#include "results.h"

#include <bundle_icp/io/trajectory.h>

#include <set>

using namespace bundle_icp;

namespace {

class KnownPoses : public ReconstructProgram {
protected:
  /** The error of a run with these arguments, which must fail before it makes results. */
  std::string
  error(const std::vector<std::string>& options, int exit_code)
  {
    const ProgramResult result = reconstruct(options);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_FALSE(boost::filesystem::exists(out)) << "nothing is left of a run that failed";
    return result.err;
  }

  /** The true poses, in another world and at other times. */
  std::string
  writePoses(double delay)
  {
    Trajectory poses = readTrajectory(scan + "/groundtruth.txt");
    const Pose other(Eigen::Translation3d(5, 0, 0) *
                     Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()));
    for (TimedPose& pose : poses)
      pose = {pose.timestamp + delay, other * pose.world_from_camera};
    writeTrajectory(folder.path("poses.txt"), poses);
    return folder.path("poses.txt");
  }
};

} // namespace

TEST_F(KnownPoses, AreAPriorThatTheReportJudges)
{
  simulate();
  const ProgramResult result = reconstruct({"--no-mesh", "--pose-prior", writePoses(0) + ",0.02"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json content = report();
  for (const auto& finding : content["findings"])
    if (finding["kind"] == "pose_prior") {
      EXPECT_EQ(finding["severity"], "note") << finding;
      EXPECT_EQ(finding["evidence"]["frames"], 12);
      EXPECT_EQ(finding["evidence"]["said_position_m"], 0.02);
      EXPECT_NEAR(finding["evidence"]["said_rotation_degrees"], 1, 1e-9);
      EXPECT_LT(finding["evidence"]["measured_position_m"], 0.01);
      return;
    }
  ADD_FAILURE() << "the report says nothing of the prior";
}

TEST_F(KnownPoses, AreTakenAsTheyAre)
{
  simulate();
  const std::string poses = writePoses(0.001);
  ASSERT_EQ(reconstruct({"--poses", poses}).exit_code, 0);
  EXPECT_EQ(namesIn(out),
            (std::set<std::string>{"calibration.json", "mesh.ply", "mesh.png", "report.json",
                                   "trajectory.png", "trajectory.txt"}));
  const nlohmann::json content = report();
  EXPECT_EQ(content["options"]["method"], "given_poses");
  EXPECT_EQ(content["options"]["poses"], poses);
  for (const auto& frame : content["frames"])
    EXPECT_EQ(frame["verdict"], "unchecked");
  const Trajectory given = readTrajectory(poses), used = readTrajectory(out + "/trajectory.txt");
  ASSERT_EQ(used.size(), given.size());
  for (std::size_t i = 0; i < used.size(); ++i)
    EXPECT_TRUE(used[i].world_from_camera.isApprox(given[i].world_from_camera, 1e-6));
  ASSERT_EQ(reconstruct({"--no-mesh", "--poses", "recording"}).exit_code, 0);
  EXPECT_EQ(report()["options"]["poses"], "the recording");
  Trajectory late = readTrajectory(scan + "/groundtruth.txt");
  for (TimedPose& pose : late)
    pose.timestamp += 0.03;
  writeTrajectory(scan + "/groundtruth.txt", late);
  ASSERT_EQ(
      reconstruct({"--no-mesh", "--poses", "recording", "--max-time-difference", "0.04"}).exit_code,
      0);
  const nlohmann::json matched = report();
  EXPECT_EQ(matched["frames"].size(), 12u);
  for (const auto& frame : matched["frames"])
    EXPECT_EQ(frame["verdict"], "unchecked");
}

TEST_F(KnownPoses, ThatCannotServeAreRefused)
{
  simulate();
  const std::string poses = writePoses(0), missing = folder.path("absent.txt");
  for (const std::string option : {"--pose-prior", "--poses"})
    EXPECT_CONTAINS(error({option, missing}, 1), "absent.txt: ");
  for (const std::string sigma : {"0", "-0.1"})
    EXPECT_CONTAINS(error({"--pose-prior", poses + "," + sigma}, 2), "SIGMA must be above 0");
  EXPECT_CONTAINS(error({"--pose-prior", "recording"}, 1), "measured truth, which is no prior");
  EXPECT_CONTAINS(error({"--pose-prior", poses, "--method", "f2m_icp"}, 2), "--pose-prior: only");
  EXPECT_CONTAINS(error({"--poses", poses, "--method", "f2m_icp"}, 2), "need no --method");
  EXPECT_CONTAINS(error({"--poses", poses, "--pose-prior", poses}, 2), "--pose-prior and --poses");
  EXPECT_CONTAINS(error({"--poses", poses, "--moving", "object"}, 2), "not with --moving object");
  const std::string late = writePoses(100);
  for (const std::string option : {"--pose-prior", "--poses"})
    EXPECT_CONTAINS(error({option, late}, 1), "poses.txt: no pose is within 0.02 s of a frame");
  boost::filesystem::remove(scan + "/groundtruth.txt");
  EXPECT_CONTAINS(error({"--poses", "recording"}, 1), "the recording brings no poses");
  EXPECT_CONTAINS(error({"--pose-prior", "recording"}, 1), "no poses that could be a prior");
}
