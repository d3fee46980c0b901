// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_reconstruct on a simulated scan: results, report and options.
#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/io/trajectory.h>

#include "messages.h"
#include "recordings.h"
#include "results.h"

#include <boost/crc.hpp>
#include <pcl/conversions.h>
#include <pcl/io/ply_io.h>

#include <map>
#include <sstream>

using namespace bundle_icp;

namespace {

class ReconstructScan : public ReconstructProgram {
protected:
  void
  SetUp() override
  {
    ReconstructProgram::SetUp();
    if (!IsSkipped())
      simulate();
  }

  std::vector<std::size_t>
  ids() const
  {
    std::vector<std::size_t> ids;
    const nlohmann::json json = report();
    for (const auto& frame : json["frames"])
      ids.push_back(frame["id"]);
    return ids;
  }

  pcl::PointCloud<pcl::PointXYZ>
  meshVertices() const
  {
    pcl::PolygonMesh mesh;
    EXPECT_EQ(pcl::io::loadPLYFile(out + "/mesh.ply", mesh), 0);
    EXPECT_FALSE(mesh.polygons.empty());
    pcl::PointCloud<pcl::PointXYZ> vertices;
    pcl::fromPCLPointCloud2(mesh.cloud, vertices);
    return vertices;
  }
};

/** Two recordings, of every other frame each. */
std::pair<std::string, std::string>
twoRecordings(const std::string& scan, const TemporaryFolder& folder)
{
  const std::string first = folder.path("first"), second = folder.path("second");
  for (const std::string& part : {first, second}) {
    boost::filesystem::create_directory(part);
    for (const char* const images : {"rgb", "depth"})
      boost::filesystem::create_directory_symlink(scan + "/" + images, part + "/" + images);
    boost::filesystem::copy_file(scan + "/intrinsics.txt", part + "/intrinsics.txt");
    for (const char* const list : {"rgb.txt", "depth.txt"}) {
      std::istringstream lines(readText(scan + "/" + list));
      std::string text, kept;
      for (int i = 0; std::getline(lines, text);)
        if (text[0] != '#' && (i++ % 2 == 0) == (part == first))
          kept += text + "\n";
      writeText(part + "/" + list, kept);
    }
  }
  return {first, second};
}

} // namespace

TEST_F(ReconstructScan, TheFolderOfTheResultMayBeTheOneWhereOneIs)
{
  const std::string program = std::string(BUNDLE_ICP_PROGRAM_FOLDER) + "/bundle_icp_reconstruct";
  for (const std::string name : {".", "./", "..", "deeper/.."}) {
    boost::filesystem::remove_all(out);
    boost::filesystem::create_directories(out + "/inner/deeper");
    const std::string command = "cd '" + out + "/inner' && " + program + " '" + scan + "' -o " +
                                name + " --no-mesh --max-frames 4 -q >'" + out + ".txt' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << name << readText(out + ".txt");
    EXPECT_NE(readText(out + (name == ".." ? "" : "/inner") + "/trajectory.txt"), "") << name;
  }
}

TEST_F(ReconstructScan, TheReportListsAllFiles)
{
  ASSERT_EQ(reconstruct().exit_code, 0);
  std::set<std::string> listed{"report.json", "scan.db"}; // what goes on changing is not listed
  const nlohmann::json json = report();
  for (const auto& file : json["files"]) {
    const std::string name = file["name"], bytes = readText(out + "/" + name);
    boost::crc_32_type crc;
    crc.process_bytes(bytes.data(), bytes.size());
    EXPECT_EQ(file["bytes"], bytes.size()) << name;
    EXPECT_EQ(file["crc32"], crc.checksum()) << name;
    listed.insert(name);
  }
  EXPECT_EQ(namesIn(out), listed);
}

TEST_F(ReconstructScan, GivesPosesPointsMeshAndReport)
{
  const ProgramResult result = reconstruct();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_CONTAINS(result.out, "12 of 12 frames have a pose in one world");
  EXPECT_EQ(namesIn(out),
            (std::set<std::string>{"calibration.json", "mesh.ply", "mesh.png", "report.json",
                                   "scan.db", "sparse.ply", "trajectory.png", "trajectory.txt"}));
  const Trajectory truth = readTrajectory(scan + "/groundtruth.txt"),
                   estimate = readTrajectory(out + "/trajectory.txt");
  EXPECT_EQ(estimate.size(), 12u);
  EXPECT_TRUE(estimate.front().world_from_camera.isApprox(Pose::Identity(), 1e-6));
  const auto error = absoluteTrajectoryError(truth, estimate);
  ASSERT_TRUE(error);
  EXPECT_LT(error->translation.rmse, 0.005); // exact depth in images of 320x240
  EXPECT_GT(meshVertices().size(), 1000u);
  EXPECT_FALSE(cv::imread(out + "/mesh.png").empty());
}

TEST_F(ReconstructScan, IsTheSameInFormatsThatKeepTheSame)
{
  std::map<std::string, std::string> meshes, trajectories;
  std::map<std::string, Trajectory> poses;
  for (const char* const format : {"open3d", "nerfstudio", "pcd"}) {
    scan = folder.path(format);
    simulate(format);
    const ProgramResult result = reconstruct();
    ASSERT_EQ(result.exit_code, 0) << result.err;
    meshes[format] = readText(out + "/mesh.ply");
    trajectories[format] = readText(out + "/trajectory.txt");
    poses[format] = readTrajectory(out + "/trajectory.txt");
  }
  EXPECT_EQ(trajectories["open3d"], trajectories["nerfstudio"]);
  EXPECT_TRUE(meshes["open3d"] == meshes["nerfstudio"]); // too long to be printed
  // The intrinsics of clouds are found from their points.
  const auto error = absoluteTrajectoryError(poses["open3d"], poses["pcd"]);
  ASSERT_TRUE(error);
  EXPECT_LT(error->translation.rmse, 1e-4);
}

TEST_F(ReconstructScan, MeshIsFilledAndDecimatedAndWrittenInEachFormat)
{
  ASSERT_EQ(reconstruct().exit_code, 0);
  const std::size_t triangles = report()["mesh"]["triangles"];
  const ProgramResult result =
      reconstruct({"--mesh-format", "ply,obj,stl", "--fill-holes", "0.3", "--decimate", "2000"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_CONTAINS(result.err, "holes filled");
  EXPECT_CONTAINS(result.err, "largest deviation");
  const nlohmann::json mesh = report()["mesh"];
  EXPECT_GT(triangles, 4000u);
  EXPECT_LE(mesh["triangles"], 2000);
  EXPECT_GE(mesh["decimation"]["triangles_before"], triangles); // more, by what fills holes
  EXPECT_GT(mesh["holes_filled"], 0);
  EXPECT_GT(mesh["filled_area"], 0);
  EXPECT_GT(mesh["decimation"]["error"], 0);
  EXPECT_LT(mesh["decimation"]["error"], 0.1);
  EXPECT_EQ(boost::filesystem::file_size(out + "/mesh.stl"),
            84 + 50 * mesh["triangles"].get<std::size_t>());
  EXPECT_CONTAINS(readText(out + "/mesh.obj"), "\nf ");
  pcl::PCLPointCloud2 vertices;
  ASSERT_EQ(pcl::io::loadPLYFile(out + "/mesh.ply", vertices), 0);
  for (const char* field : {"normal_x", "rgb", "weight", "std_deviation"})
    EXPECT_GE(pcl::getFieldIndex(vertices, field), 0) << field;
}

TEST_F(ReconstructScan, ReportHasWhatWasPromised)
{
  ASSERT_EQ(reconstruct({"--no-mesh", "--max-frames", "4"}).exit_code, 0);
  const nlohmann::json json = report();
  for (const char* const key : {"version", "frames", "components", "timing_s", "peak_memory_bytes",
                                "calibration", "options"})
    EXPECT_TRUE(json.contains(key)) << key;
  ASSERT_EQ(json["frames"].size(), 4u);
  for (const auto& frame : json["frames"]) {
    for (const char* const key :
         {"id", "timestamp", "registered", "matches", "inliers", "icp_rmse"})
      EXPECT_TRUE(frame.contains(key)) << key;
    EXPECT_EQ(frame["registered"], true);
  }
  EXPECT_GT(json["peak_memory_bytes"].get<double>(), 1e6);
  EXPECT_GT(json["timing_s"]["features"].get<double>(), 0);
  EXPECT_EQ(json["calibration"]["nominal_camera"]["fx"], 262.0);
  EXPECT_FALSE(boost::filesystem::exists(out + "/mesh.ply"));
}

TEST_F(ReconstructScan, MatchingByTreesRepeatsItself)
{
  const auto by_trees = [&](const std::string& threads) {
    const std::vector<std::string> arguments{"--no-mesh", "--matching", "kdtree", "--threads",
                                             threads};
    EXPECT_EQ(reconstruct(arguments).exit_code, 0);
    EXPECT_EQ(report()["options"]["matching"], "kdtree");
    return readText(out + "/trajectory.txt") + readText(out + "/sparse.ply");
  };
  const std::string trees = by_trees("1");
  EXPECT_EQ(by_trees("3"), trees);
  ASSERT_EQ(reconstruct({"--no-mesh"}).exit_code, 0);
  EXPECT_EQ(report()["options"]["matching"], "exact");
  EXPECT_NE(readText(out + "/trajectory.txt") + readText(out + "/sparse.ply"), trees);
}

TEST_F(ReconstructScan, BadFilesAreSkippedAndNamed)
{
  recordings::truncate(scan + "/rgb/0.500000.png", 0.6);
  writeText(scan + "/groundtruth.txt", "0 0 0 0 nan 0 0 1\n");
  const ProgramResult result = reconstruct({"--no-mesh"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_CONTAINS(result.err, "rgb/0.500000.png: the image is truncated");
  EXPECT_CONTAINS(result.err, "groundtruth.txt:1: 'nan' is not a finite");
  EXPECT_CONTAINS(result.out, "11 of 12 frames");
  const nlohmann::json json = report();
  const auto& frame = json["frames"][5];
  EXPECT_EQ(frame["registered"], false);
  EXPECT_CONTAINS(frame["reason"].get<std::string>(), "rgb/0.500000.png: the image is");
  EXPECT_CONTAINS(json["skipped_files"][0]["reason"].get<std::string>(), "'nan'");
}

TEST_F(ReconstructScan, RegionLimitsTheMesh)
{
  // x negative: a value, not an option.
  ASSERT_EQ(reconstruct({"--roi", "-0.4,-0.3,0.2,0.4,0.5,3"}).exit_code, 0);
  const float block = 8 * 0.02f; // voxels are allocated in whole blocks
  const Eigen::Array3f low(-0.4f, -0.3f, 0.2f), high(0.4f, 0.5f, 3);
  for (const auto& vertex : meshVertices().points) {
    EXPECT_TRUE((vertex.getArray3fMap() >= low - block).all()) << vertex;
    EXPECT_TRUE((vertex.getArray3fMap() <= high + block).all()) << vertex;
  }
}

TEST_F(ReconstructScan, OrderOfFramesDoesNotMatter)
{
  ASSERT_EQ(reconstruct({"--no-mesh"}).exit_code, 0);
  const Trajectory ordered = readTrajectory(out + "/trajectory.txt");
  const std::vector<std::size_t> ordered_ids = ids();
  ASSERT_EQ(reconstruct({"--no-mesh", "--shuffle", "7"}).exit_code, 0);
  const Trajectory shuffled = readTrajectory(out + "/trajectory.txt");
  EXPECT_NE(ids(), ordered_ids);
  ASSERT_EQ(shuffled.size(), ordered.size());
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    EXPECT_EQ(shuffled[i].timestamp, ordered[i].timestamp);
    EXPECT_TRUE(shuffled[i].world_from_camera.isApprox(ordered[i].world_from_camera, 1e-6));
  }
}

TEST_F(ReconstructScan, StrideAndLimitOfFrames)
{
  ASSERT_EQ(reconstruct({"--no-mesh", "--stride", "2", "--max-frames", "3"}).exit_code, 0);
  EXPECT_EQ(ids(), (std::vector<std::size_t>{0, 2, 4}));
}

TEST_F(ReconstructScan, FramesOfALaterRecordingAreAdded)
{
  const auto [first, second] = twoRecordings(scan, folder);
  ASSERT_EQ(runProgram("bundle_icp_reconstruct", {first, "-o", out, "--no-mesh", "-q"}).exit_code,
            0);
  const ProgramResult result =
      runProgram("bundle_icp_reconstruct", {second, "-o", out, "--no-mesh", "--add"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_CONTAINS(result.out, "12 of 12 frames have a pose in one world");
  EXPECT_CONTAINS(result.err, "of an earlier run: features of 6 frames, matches of 15 pairs");
  const nlohmann::json json = report();
  EXPECT_EQ(json["dataset"]["recordings"], (std::vector<std::string>{first, second}));
  for (const auto& frame : json["frames"]) {
    EXPECT_TRUE(frame["recording"] == first || frame["recording"] == second);
    EXPECT_EQ(frame["world_from_camera"].size(), 7u);
  }
  // As if both were named at once, one of them twice.
  const std::string poses = readText(out + "/trajectory.txt");
  ASSERT_EQ(runProgram("bundle_icp_reconstruct",
                       {first, second, first + "/", "-o", folder.path("both"), "--no-mesh", "-q"})
                .exit_code,
            0);
  EXPECT_EQ(readText(folder.path("both") + "/trajectory.txt"), poses);
}

TEST_F(ReconstructScan, ResultsAreMerged)
{
  const auto [first, second] = twoRecordings(scan, folder);
  std::vector<std::string> arguments{"-o", out, "--no-mesh"};
  for (const std::string& part : {first, second}) {
    const std::string result = part + "_result";
    ASSERT_EQ(
        runProgram("bundle_icp_reconstruct", {part, "-o", result, "--no-mesh", "-q"}).exit_code, 0);
    arguments.push_back(result);
  }
  const std::string before = readText(arguments.back() + "/report.json");
  const ProgramResult result = runProgram("bundle_icp_merge", arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_CONTAINS(result.out, "12 of 12 frames have a pose in one world");
  EXPECT_CONTAINS(result.err, "of an earlier run: features of 12 frames, matches of 30 pairs");
  EXPECT_EQ(report()["dataset"]["recordings"], (std::vector<std::string>{first, second}));
  EXPECT_EQ(readText(arguments.back() + "/report.json"), before);
  // As if the recordings had been named at once.
  const std::string poses = readText(out + "/trajectory.txt"), both = folder.path("both");
  ASSERT_EQ(runProgram("bundle_icp_reconstruct", {first, second, "-o", both, "--no-mesh", "-q"})
                .exit_code,
            0);
  EXPECT_EQ(readText(both + "/trajectory.txt"), poses);
  // Into one of the two.
  arguments[1] = arguments.back();
  EXPECT_EQ(runProgram("bundle_icp_merge", arguments).exit_code, 0);
}

TEST_F(ReconstructScan, OneResultCannotBeMerged)
{
  ProgramResult result = runProgram("bundle_icp_merge", {scan, "-o", out});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_CONTAINS(result.err, "expected RESULT RESULT... -o OUT");
  result = runProgram("bundle_icp_merge", {scan, folder.path("none"), "-o", out});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_CONTAINS(result.err, "report.json: cannot be opened; an earlier result is needed");
  for (const std::string of_scans : {"--add", "--live"})
    EXPECT_CONTAINS(runProgram("bundle_icp_merge", {scan, scan, "-o", out, of_scans}).err,
                    "'" + of_scans + "'");
}

TEST_F(ReconstructScan, NothingIsAddedToNoResult)
{
  const std::vector<std::string> arguments{scan, "-o", out, "--add"};
  ProgramResult result = runProgram("bundle_icp_reconstruct", arguments);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_CONTAINS(result.err, "report.json: cannot be opened; an earlier result is needed");
  for (const std::string content : {"{}", "no JSON", R"({"dataset": {"recordings": [3]}})"}) {
    writeText(out + "/report.json", content);
    result = runProgram("bundle_icp_reconstruct", arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_CONTAINS(result.err, "report.json: names no recordings");
    EXPECT_EQ(readText(out + "/report.json"), content);
  }
}
