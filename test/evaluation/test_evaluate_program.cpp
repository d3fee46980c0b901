// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// The program bundle_icp_evaluate: figures, messages and exit codes.
#include <bundle_icp/io/trajectory.h>

#include "messages.h"
#include "program.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pcl/conversions.h>
#include <pcl/io/ply_io.h>

#include <algorithm>
#include <cmath>

using namespace bundle_icp;

namespace {

class EvaluateProgram : public ::testing::Test {
protected:
  void
  SetUp() override
  {
    if (!hasProgram("bundle_icp_evaluate"))
      GTEST_SKIP() << "bundle_icp_evaluate is not built";
    // A circle, estimated 10 % too large, in the same world frame: an error of 0.1 m
    // everywhere.
    for (int i = 0; i < 40; ++i) {
      const double angle = 2 * M_PI * i / 40;
      TimedPose pose;
      pose.timestamp = 0.1 * i;
      pose.world_from_camera.translation() << std::cos(angle), std::sin(angle), 0;
      trajectory.push_back(pose);
      pose.world_from_camera.translation() *= 1.1;
      larger.push_back(pose);
    }
    writeTrajectory(truth, trajectory);
    writeTrajectory(estimate, larger);
  }

  ProgramResult
  run(std::vector<std::string> arguments)
  {
    return runProgram("bundle_icp_evaluate", arguments);
  }

  // Runs with arguments that must fail, and returns the one line of its error.
  std::string
  error(const std::vector<std::string>& arguments, int exit_code = 1)
  {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.err.rfind("bundle_icp_evaluate: ", 0), 0u) << result.err;
    EXPECT_EQ(result.err.find(": : "), std::string::npos) << result.err;
    return result.err;
  }

  TemporaryFolder folder;
  std::string truth = folder.path("truth.txt"), estimate = folder.path("estimate.txt");
  Trajectory trajectory, larger;
};

} // namespace

TEST_F(EvaluateProgram, PrintsATable)
{
  const ProgramResult result = run({truth, estimate});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_CONTAINS(result.out, "frames with a pose  not known (40 poses");
  EXPECT_CONTAINS(result.out, "ATE                 rmse 0.100000 m");
  EXPECT_CONTAINS(result.out, "(40 pairs)");
  EXPECT_CONTAINS(result.out, "RPE per frame");
  EXPECT_CONTAINS(result.out, "RPE per second");
  EXPECT_CONTAINS(result.out, "RPE all pairs");
}

TEST_F(EvaluateProgram, PrintsJson)
{
  const ProgramResult result = run({truth, estimate, "--json"});
  ASSERT_EQ(result.exit_code, 0);
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_NEAR(json["ate_m"]["rmse"].get<double>(), 0.1, 1e-7);
  EXPECT_EQ(json["rpe_frame"]["translation_m"]["count"], 38);
  EXPECT_LT(json["rpe_all_pairs"]["rotation_rad"]["max"].get<double>(), 1e-7);
  EXPECT_TRUE(json["frames"].is_null());
  EXPECT_EQ(json["poses"], 40);
}

TEST_F(EvaluateProgram, SharesOfFrames)
{
  writeText(folder.path("rgb.txt"), "# list\n0.0 a.png\n0.1 b.png\n9.0 c.png\n9.1 d.png\n");
  const ProgramResult result = run({truth, estimate, "--frames", folder.path("rgb.txt")});
  EXPECT_CONTAINS(result.out, "frames with a pose  2 of 4 (50.0 %)");
}

TEST_F(EvaluateProgram, TakesARecordingAsTruth)
{
  const std::string place = folder.path("scan");
  recordings::writeTum(place, 8);
  boost::filesystem::remove(place + "/intrinsics.txt"); // poses need no calibration
  EXPECT_CONTAINS(error({place, estimate}), "scan: the recording holds no poses");
  writeTrajectory(place + "/groundtruth.txt", trajectory);
  writeTrajectory(estimate, {larger.begin(), larger.begin() + 6});
  const ProgramResult result = run({place, estimate, "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["frames"], 8);
  EXPECT_EQ(json["frames_with_pose"], 6);
  EXPECT_EQ(json["fraction_with_pose"], 0.75);
  writeText(place + "/groundtruth.txt", "0 0 0 0 nan 0 0 1\n");
  EXPECT_CONTAINS(error({place, estimate}), "groundtruth.txt:1: 'nan' is not a finite");
}

TEST_F(EvaluateProgram, PosesThatADeviceEstimatedAreNoTruth)
{
  const std::string place = folder.path("scan");
  recordings::writeOpen3d(place, 8); // as ScanNet's exporters write it
  writeText(place + "/intrinsic/intrinsic_color.txt", "60 0 32 0\n0 60 24 0\n0 0 1 0\n0 0 0 1\n");
  for (int i = 0; i < 8; ++i) {
    larger[i].timestamp = i / 30.0;
    writeText(place + "/pose/" + std::to_string(i) + ".txt",
              "1 0 0 " + std::to_string(std::cos(i)) + "\n0 1 0 " + std::to_string(std::sin(i)) +
                  "\n0 0 1 0\n0 0 0 1\n");
  }
  writeTrajectory(estimate, {larger.begin(), larger.begin() + 8});
  const ProgramResult table = run({place, estimate}), result = run({place, estimate, "--json"});
  EXPECT_EQ(table.exit_code, 0); // the figures say what they say
  EXPECT_CONTAINS(table.err, "warning: " + place +
                                 ": the poses of the recording are those that "
                                 "BundleFusion estimated, not measured truth");
  const auto json = nlohmann::json::parse(result.out);
  ASSERT_EQ(json["warnings"].size(), 1u);
  EXPECT_CONTAINS(json["warnings"][0].get<std::string>(), "BundleFusion estimated");
}

TEST_F(EvaluateProgram, ComparesMeshesAfterAlignment)
{
  // The mesh, a square, is in a world 0.5 m away from that of the truth.
  for (TimedPose& pose : larger)
    pose.world_from_camera.translation().z() += 0.5;
  writeTrajectory(estimate, larger);
  pcl::PointCloud<pcl::PointXYZ> vertices, surface;
  for (const auto& [x, y] : {std::make_pair(0.f, 0.f), std::make_pair(1.f, 0.f),
                             std::make_pair(1.f, 1.f), std::make_pair(0.f, 1.f)})
    vertices.push_back(pcl::PointXYZ(x, y, 0.5f));
  for (int i = 0; i < 40000; ++i)
    surface.push_back(pcl::PointXYZ(0.01f * (i % 200), 0.005f * (i / 200), 0));
  pcl::PolygonMesh mesh;
  pcl::toPCLPointCloud2(vertices, mesh.cloud);
  mesh.polygons.resize(1);
  mesh.polygons[0].vertices = {0, 1, 2, 3};
  const std::string mesh_file = folder.path("mesh.ply"), points = folder.path("surface.ply");
  pcl::io::savePLYFileBinary(mesh_file, mesh);
  pcl::io::savePLYFileBinary(points, surface);
  const ProgramResult result =
      run({truth, estimate, "--mesh", mesh_file, "--surface", points, "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_LT(json["mesh_m"]["mean"].get<double>(), 0.005);
  EXPECT_NEAR(json["mesh_completeness"].get<double>(), 0.5, 0.01); // of 2 m x 1 m
  EXPECT_CONTAINS(run({truth, estimate, "--mesh", mesh_file, "--surface", points}).out,
                  "of the surface within 0.01 m");

  EXPECT_CONTAINS(error({truth, estimate, "--mesh", folder.path("x.ply"), "--surface", points}),
                  "x.ply: cannot be opened");
  writeText(mesh_file, "not a mesh");
  EXPECT_CONTAINS(error({truth, estimate, "--mesh", mesh_file, "--surface", points}),
                  "mesh.ply: cannot be read as PLY");
}

TEST_F(EvaluateProgram, FailsWithOneLineThatNamesTheFile)
{
  EXPECT_CONTAINS(error({folder.path("x.txt"), estimate}), "x.txt: cannot be opened");
  EXPECT_CONTAINS(error({truth, folder.path("x.txt")}), "x.txt: cannot be opened");
  writeText(estimate, "0 0 0 0 0 0 0 2\n");
  EXPECT_CONTAINS(error({truth, estimate}), "estimate.txt:1: the quaternion has length 2");
  for (TimedPose& pose : larger)
    pose.timestamp += 100;
  writeTrajectory(estimate, larger);
  EXPECT_CONTAINS(error({truth, estimate}), "fewer than 3 of its 40 poses");
  EXPECT_CONTAINS(error({truth, estimate, "--frames", folder.path("x")}), "x: cannot be opened");
}

TEST_F(EvaluateProgram, NumbersThatAreNotFiniteAreErrors)
{
  const std::string line = "0 0 0 0 0 0 0 1\n";
  for (const std::string number : {"inf", "-inf", "nan", "infinity"}) {
    writeText(estimate, line + "1 " + number + " 0 0 0 0 0 1\n");
    EXPECT_CONTAINS(error({truth, estimate}), "estimate.txt:2: '" + number + "' is not a finite");
    writeText(estimate, line + number + " 0 0 0 0 0 0 1\n");
    EXPECT_CONTAINS(error({truth, estimate}), "estimate.txt:2: '" + number + "' is not a finite");
  }
  writeTrajectory(estimate, larger);
  std::string text = readText(estimate);
  const std::size_t at = text.find("\n0.300000 ") + 10;
  text.replace(at, text.find(' ', at) - at, "1e200"); // finite, but its square is not
  writeText(estimate, text);
  EXPECT_CONTAINS(error({truth, estimate}),
                  "estimate.txt: the error is not finite: numbers are too large");
}

TEST_F(EvaluateProgram, FiguresOfAHandfulOfPosesAreDoubtful)
{
  const auto spread = [this](double seconds, std::size_t with_partner) {
    Trajectory moved = larger;
    for (std::size_t i = with_partner; i < moved.size(); ++i)
      moved[i].timestamp += seconds;
    writeTrajectory(estimate, moved);
    return run({truth, estimate});
  };
  EXPECT_EQ(spread(100, 10).exit_code, 0);
  EXPECT_EQ(spread(100, 10).err, "");
  const ProgramResult few = spread(100, 4);
  EXPECT_EQ(few.exit_code, 3);
  EXPECT_CONTAINS(few.out, "(4 pairs)"); // the benchmark's figures are printed all the same
  EXPECT_CONTAINS(few.err, "bundle_icp_evaluate: warning: " + estimate +
                               ": only 4 poses have a true pose; alignment hides much");
  Trajectory more;
  for (int i = 0; i < 100; ++i) {
    more.push_back(larger[i % 40]);
    more.back().timestamp = i < 9 ? 0.1 * i : 100 + i;
  }
  writeTrajectory(estimate, more);
  const ProgramResult small = run({truth, estimate, "--json"});
  EXPECT_EQ(small.exit_code, 3);
  EXPECT_CONTAINS(small.err, "only 9 of its 100 poses lie within 0.02");
  EXPECT_CONTAINS(small.err, "the figures say little of the others");
  EXPECT_EQ(nlohmann::json::parse(small.out)["warnings"].size(), 1u);
  EXPECT_EQ(nlohmann::json::parse(small.out)["ate_m"]["count"], 9);
}

TEST_F(EvaluateProgram, ANameThatIsNotUtf8LosesNoFigures)
{
  const std::string odd = folder.path("t\xff.txt");
  writeTrajectory(odd, Trajectory(larger.begin(), larger.begin() + 4));
  const ProgramResult result = run({truth, odd, "--json"});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_CONTAINS(nlohmann::json::parse(result.out)["warnings"][0].get<std::string>(),
                  "only 4 poses have a true pose");
}

TEST_F(EvaluateProgram, MeshesWithoutSizeOrWithTooMuchAreRefused)
{
  const std::string mesh = folder.path("mesh.ply"), points = folder.path("surface.ply");
  const auto write = [](const std::string& file, const std::string& far, const char* faces) {
    writeText(file, "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                    "property float z\nelement face " +
                        std::string(*faces ? "1" : "0") +
                        "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 " +
                        far + " 0\n" + faces);
  };
  const std::vector<std::string> arguments{truth, estimate, "--mesh", mesh, "--surface", points};
  write(points, "1", "");
  for (const std::string far : {"inf", "nan"}) {
    write(mesh, far, "3 0 1 2\n");
    EXPECT_CONTAINS(error(arguments), "mesh.ply: vertex 2 is not finite");
  }
  write(mesh, "1e30", "3 0 1 2\n");
  EXPECT_CONTAINS(error(arguments), mesh + ": surfaceError: ");
  EXPECT_CONTAINS(error(arguments), "more area than 1e8 samples cover");
  write(mesh, "1", "3 0 1 2\n");
  write(points, "inf", "");
  EXPECT_CONTAINS(error(arguments), "surface.ply: vertex 2 is not finite");
  write(points, "1", "");
  const ProgramResult few = run(arguments);
  EXPECT_EQ(few.exit_code, 3);
  EXPECT_CONTAINS(few.err, "surface.ply: has only 3 points; the figures of the mesh say little");
  write(mesh, "0.001", "3 0 1 2\n");
  EXPECT_CONTAINS(run(arguments).err, "mesh.ply: has only 20 samples of its area");
  Trajectory away = larger;
  for (TimedPose& pose : away)
    pose.world_from_camera.pretranslate(Eigen::Vector3d(0, 2e9, 0));
  writeTrajectory(estimate, away);
  EXPECT_CONTAINS(error(arguments), "estimate.txt: its world lies 2000000");
}

TEST_F(EvaluateProgram, WrongUsageIsTwo)
{
  EXPECT_CONTAINS(error({}, 2), "expected GROUNDTRUTH and TRAJECTORY");
  EXPECT_CONTAINS(error({truth}, 2), "expected GROUNDTRUTH and TRAJECTORY");
  EXPECT_CONTAINS(error({truth, estimate, "third"}, 2), "positional");
  EXPECT_CONTAINS(error({truth, estimate, "--unknown"}, 2), "--unknown");
  EXPECT_CONTAINS(error({truth, estimate, "--mesh", "m.ply"}, 2), "belong together");
  EXPECT_CONTAINS(error({truth, estimate, "--max-difference", "0"}, 2), "--max-difference");
  EXPECT_CONTAINS(error({truth, estimate, "--complete-within", "-1"}, 2), "completeness");
  const ProgramResult help = run({"-h"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_CONTAINS(help.out, "Usage: bundle_icp_evaluate GROUNDTRUTH TRAJECTORY");
  EXPECT_CONTAINS(help.out, "[s]");
}
