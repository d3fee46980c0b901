// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// The folder that a synthetic scan is written to, and the program that does it.
#include "messages.h"
#include "program.h"
#include "scans.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <pcl/exceptions.h>
#include <pcl/io/ply_io.h>

#include <map>
#include <thread>

using namespace bundle_icp;
namespace fs = boost::filesystem;

namespace {

SyntheticScanWriteOptions
coarse(int num_threads = 1)
{
  SyntheticScanWriteOptions options;
  options.surface_spacing = 0.02;
  options.num_threads = num_threads;
  return options;
}

} // namespace

TEST(WriteSyntheticScan, IsReadBackAsATumRecording)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 4;
  options.hole_fraction = 0.05;
  options.focal_error = 0.01;
  const SyntheticScan scan(options);
  const TemporaryFolder folder;
  writeSyntheticScan(scan, folder.path("new/scan"), coarse());

  const auto dataset = openDataset(folder.path("new/scan"));
  EXPECT_EQ(dataset->format(), "TUM RGB-D");
  ASSERT_EQ(dataset->size(), scan.size());
  EXPECT_NEAR(dataset->camera().fx, scan.camera().fx, 1e-6);
  EXPECT_NEAR(dataset->camera().cy, scan.camera().cy, 1e-6);
  ASSERT_EQ(dataset->groundTruth().size(), scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const RGBDFrame written = dataset->read(i), frame = scan.read(i);
    EXPECT_NEAR(written.timestamp, frame.timestamp, 1e-6);
    EXPECT_TRUE(areSame(written.color, frame.color));
    const cv::Mat holes = frame.depth != frame.depth;
    EXPECT_TRUE(areSame(holes, written.depth != written.depth));
    EXPECT_LT(cv::norm(written.depth, frame.depth, cv::NORM_INF, ~holes), 1.01e-4);
    EXPECT_TRUE(
        dataset->groundTruth()[i].world_from_camera.isApprox(scan.worldFromCamera(i), 1e-6));
  }
  EXPECT_CONTAINS(readText(folder.path("new/scan/intrinsics.txt")), "\ndepth_scale 5000\n");

  pcl::PointCloud<pcl::PointNormal> surface;
  ASSERT_EQ(pcl::io::loadPLYFile(folder.path("new/scan/surface.ply"), surface), 0);
  ASSERT_EQ(surface.size(), scan.visibleSurface(0.02)->size());
  for (const pcl::PointNormal& point : surface)
    ASSERT_LT(scan.distanceToSurface(point.getVector3fMap().cast<double>()), 1e-5);
}

TEST(WriteSyntheticScan, DepthOfAnotherCameraLiesOnTheSurface)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 2;
  options.depth_width = 128;
  options.depth_height = 96;
  options.depth_focal_length = 110;
  options.depth_offset = {0.03, -0.01, 0.005};
  const SyntheticScan scan(options);
  const DepthCamera depth_camera = *scan.depthCamera();
  const cv::Mat depth = scan.readDepth(1);
  ASSERT_EQ(depth.size(), cv::Size(128, 96));
  EXPECT_LT(largestDistance(scan, depth, depth_camera.intrinsics,
                            scan.worldFromCamera(1) * depth_camera.color_from_depth),
            1e-5);
  EXPECT_EQ(scan.read(1).depth.size(), scan.read(1).color.size());

  const TemporaryFolder folder;
  writeSyntheticScan(scan, folder.path("scan"), coarse());
  const auto dataset = openDataset(folder.path("scan"));
  const cv::Mat moved = dataset->read(1).depth;
  std::size_t measured = 0, exact = 0;
  for (int y = 0; y < moved.rows; ++y)
    for (int x = 0; x < moved.cols; ++x) {
      const double z = moved.at<float>(y, x);
      const Eigen::Vector3d point = dataset->camera().unproject(x, y, z);
      measured += !std::isnan(z);
      exact += scan.distanceToSurface(scan.worldFromCamera(1) * point) < 0.002;
    }
  EXPECT_GT(measured, moved.total() * 8 / 10);
  // Between depth pixels on either side of a fold the mesh cuts the corner.
  EXPECT_GT(exact, measured * 95 / 100);
}

TEST(WriteSyntheticScan, DepthOfTheColourCameraIsThatOfTheFrame)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 2;
  options.noise_factor = 1;
  const SyntheticScan scan(options);
  EXPECT_FALSE(scan.depthCamera());
  EXPECT_TRUE(areSame(scan.readDepth(1), scan.read(1).depth));
  options.depth_offset = {2, 0, 0};
  EXPECT_FALSE(options.isValid());
  options.depth_offset = {0.02, 0, 0};
  EXPECT_TRUE(options.isValid());
  options.gripper = true;
  EXPECT_FALSE(options.isValid());
  options.gripper = false;
  options.depth_width = 8;
  EXPECT_FALSE(options.isValid());
}

TEST(WriteSyntheticScan, DoesNotDependOnThreads)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 3;
  options.noise_factor = 1;
  const SyntheticScan scan(options);
  const TemporaryFolder folder;
  writeSyntheticScan(scan, folder.path("one"), coarse(1));
  writeSyntheticScan(scan, folder.path("three"), coarse(3));
  for (const char* file :
       {"depth/1.000000.png", "rgb/0.500000.png", "surface.ply", "rgb.txt", "groundtruth.txt"}) {
    const std::string bytes = readText(folder.path("one") + "/" + file);
    EXPECT_FALSE(bytes.empty()) << file;
    EXPECT_EQ(bytes, readText(folder.path("three") + "/" + file)) << file;
  }
}

TEST(WriteSyntheticScan, LeavesOutTheSurfaceWhenAskedTo)
{
  const TemporaryFolder folder;
  SyntheticScanWriteOptions options;
  options.surface_spacing = 0;
  writeSyntheticScan(exactScan(), folder.path(), options); // an empty folder is fine
  EXPECT_TRUE(fs::exists(folder.path("rgb.txt")));
  EXPECT_FALSE(fs::exists(folder.path("surface.ply")));
}

TEST(WriteSyntheticScan, TouchesNothingThatExists)
{
  const TemporaryFolder folder;
  writeText(folder.path("notes.txt"), "mine");
  EXPECT_CONTAINS(
      messageOf<pcl::IOException>([&] { writeSyntheticScan(exactScan(), folder.path()); }),
      "is not empty; nothing was written");
  EXPECT_CONTAINS(messageOf<pcl::IOException>(
                      [&] { writeSyntheticScan(exactScan(), folder.path("notes.txt")); }),
                  "notes.txt' exists and is not a folder");
  EXPECT_EQ(readText(folder.path("notes.txt")), "mine");
  EXPECT_FALSE(fs::exists(folder.path("rgb")));
  EXPECT_THROW(writeSyntheticScan(exactScan(), folder.path("notes.txt/below")), pcl::IOException);
}

TEST(WriteSyntheticScan, FoldersMayLieInTheCurrentOne)
{
  SyntheticScanOptions scan = smallScan();
  scan.num_frames = 2;
  const TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  for (const std::string format : {"tum", "pcd", "sens"}) {
    SyntheticScanWriteOptions options;
    options.format = format;
    options.surface_spacing = 0;
    writeSyntheticScan(SyntheticScan(scan), format, options);
    EXPECT_EQ(openDataset(format)->size(), 2u) << format;
  }
  fs::current_path(before);
}

TEST(WriteSyntheticScan, RefusesInvalidOptionsBeforeItWrites)
{
  const TemporaryFolder folder;
  SyntheticScanWriteOptions options;
  options.surface_spacing = 1e-5;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { writeSyntheticScan(exactScan(), folder.path("scan"), options); }),
                  "surface_spacing [m] is 1e-05, expected 0.001 to 1");
  options = {};
  options.num_threads = -1;
  EXPECT_THROW(writeSyntheticScan(exactScan(), folder.path("scan"), options),
               pcl::BadArgumentException);
  EXPECT_FALSE(fs::exists(folder.path("scan")));
}

TEST(WriteSyntheticScan, StopsWhenProgressAsksTo)
{
  const TemporaryFolder folder;
  const auto caller = std::this_thread::get_id();
  writeSyntheticScan(exactScan(), folder.path("scan"), coarse(2), [&](const Progress& progress) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_EQ(progress.total, exactScan().size());
    return false;
  });
  // Without lists it is not taken for a recording.
  EXPECT_FALSE(fs::exists(folder.path("scan/rgb.txt")));
  EXPECT_FALSE(fs::exists(folder.path("scan/surface.ply")));
}

TEST(WriteSyntheticScan, ReportsProgressToTheEnd)
{
  const TemporaryFolder folder;
  std::map<std::string, std::size_t> last;
  writeSyntheticScan(exactScan(), folder.path("scan"), coarse(2), [&](const Progress& progress) {
    EXPECT_GE(progress.done, last[progress.stage]);
    last[progress.stage] = progress.done;
    return true;
  });
  EXPECT_EQ(last["frames"], exactScan().size());
  EXPECT_EQ(last["surface"], 1u);
}

class SimulateProgram : public ::testing::Test {
protected:
  void
  SetUp() override
  {
    if (!hasProgram("bundle_icp_simulate"))
      GTEST_SKIP() << "bundle_icp_simulate is not built";
  }

  TemporaryFolder folder;
};

TEST_F(SimulateProgram, WritesWhatItsOptionsSay)
{
  const std::vector<std::string> arguments = {folder.path("scan"),
                                              "--full-noise",
                                              "--blur",
                                              "0",
                                              "--frames",
                                              "3",
                                              "--rate",
                                              "5",
                                              "--size",
                                              "80x60",
                                              "--focal-length",
                                              "66",
                                              "--seed",
                                              "5",
                                              "--focal-error",
                                              "0.5",
                                              "--surface-spacing",
                                              "0.05",
                                              "--threads",
                                              "1"};
  const ProgramResult result = runProgram("bundle_icp_simulate", arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_CONTAINS(result.err, "frames 3/3\n");

  SyntheticScanOptions options = SyntheticScanOptions::fullNoise();
  options.blur_fraction = 0; // given by itself
  options.num_frames = 3;
  options.frame_rate = 5;
  options.width = 80;
  options.height = 60;
  options.focal_length = 66;
  options.focal_error = 0.5;
  options.seed = 5;
  const SyntheticScan scan(options);
  const auto dataset = openDataset(folder.path("scan"));
  ASSERT_EQ(dataset->size(), 3u);
  EXPECT_NEAR(dataset->camera().fx, 99, 1e-6);
  EXPECT_TRUE(areSame(dataset->read(2).color, scan.read(2).color));
}

TEST_F(SimulateProgram, WritesDepthOfAnotherCamera)
{
  const ProgramResult result =
      runProgram("bundle_icp_simulate",
                 {folder.path("scan"), "-q", "--frames", "1", "--size", "80x60", "--focal-length",
                  "66", "--depth-size", "64x64", "--depth-focal-length", "60", "--depth-offset",
                  "-0.02,0,0.01", "--surface-spacing", "0"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_CONTAINS(readText(folder.path("scan/intrinsics.txt")),
                  "\ndepth_intrinsics 60 60 31.5 31.5\ndepth_to_color -0.02 0 0.01\n");
  EXPECT_EQ(openDataset(folder.path("scan"))->read(0).depth.size(), cv::Size(80, 60));
}

TEST_F(SimulateProgram, ExplainsItself)
{
  const ProgramResult result = runProgram("bundle_icp_simulate", {"-h"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* option : {"--frames",        "--rate",
                             "--size",          "--focal-length",
                             "--seed",          "--threads",
                             "--full-noise",    "--noise",
                             "--quantisation",  "--holes",
                             "--flying-pixels", "--color-noise",
                             "--blur",          "--exposure-change",
                             "--depth-size",    "--depth-focal-length",
                             "--depth-offset",  "--depth-bias",
                             "--focal-error",   "--time-offset",
                             "--unordered"})
    EXPECT_CONTAINS(result.out, option);
}

TEST_F(SimulateProgram, ExitCodesTellFailureFromWrongUse)
{
  writeText(folder.path("full/file"), "mine");
  const std::string out = folder.path("scan");
  const std::tuple<std::vector<std::string>, int, const char*> cases[] = {
      {{}, 2, "expected a folder OUT"},
      {{out, "--size", "640"}, 2, "--size 640: expected WxH"},
      {{out, "--depth-size", "64"}, 2, "--depth-size 64: expected WxH"},
      {{out, "--depth-offset", "0.1,0"}, 2, "--depth-offset 0.1,0: expected X,Y,Z"},
      {{out, "--depth-offset", "2,0,0"}, 2, "depth_offset [m] is 2"},
      {{out, "--depth-size", "64x64", "--gripper"}, 2, "registered depth only"},
      {{out, "--frames", "0"}, 2, "num_frames is 0"},
      {{out, "--noise", "much"}, 2, "--noise"},
      {{out, "--nonsense"}, 2, "nonsense"},
      {{out, "--threads", "-1"}, 2, "num_threads is -1"},
      {{folder.path("full")}, 1, "is not empty; nothing was written"},
      {{folder.path("full/file")}, 1, "is not a folder"},
  };
  for (const auto& [arguments, exit_code, message] : cases) {
    const ProgramResult result = runProgram("bundle_icp_simulate", arguments);
    EXPECT_EQ(result.exit_code, exit_code) << message;
    EXPECT_EQ(result.err.rfind("bundle_icp_simulate: ", 0), 0u) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_CONTAINS(result.err, message);
  }
  EXPECT_FALSE(fs::exists(out));
}

TEST(WriteSyntheticScan, WritesMasksWhenAskedTo)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 3;
  options.gripper = true;
  const SyntheticScan scan(options);
  const TemporaryFolder folder;
  SyntheticScanWriteOptions with_masks;
  with_masks.surface_spacing = 0;
  with_masks.masks = true;
  writeSyntheticScan(scan, folder.path("scan"), with_masks);
  const auto dataset = openDataset(folder.path("scan"));
  for (std::size_t i = 0; i < scan.size(); ++i)
    EXPECT_TRUE(areSame(dataset->read(i).depth > 0, scan.mask(i))) << i;
}
