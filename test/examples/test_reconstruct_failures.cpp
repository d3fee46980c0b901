// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// bundle_icp_reconstruct with what cannot be reconstructed: the message, the exit code,
// and the results of an earlier run, which must survive.
#include "messages.h"
#include "recordings.h"
#include "results.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fs = boost::filesystem;

namespace {

const std::set<std::string> earlier = {"trajectory.txt",  "sparse.ply", "mesh.ply",
                                       "report.json",     "mesh.png",   "trajectory.png",
                                       "calibration.json"};

class ReconstructFailure : public ReconstructProgram {
protected:
  void
  SetUp() override
  {
    ReconstructProgram::SetUp();
    recordings::writeTum(scan, 3);
    for (const std::string& name : earlier)
      writeText(out + "/" + name, "of an earlier run");
  }

  void
  expectEarlierResults()
  {
    std::set<std::string> names = namesIn(out);
    names.erase("scan.db"); // keeps what a run has found before it fails
    EXPECT_EQ(names, earlier);
    for (const std::string& name : earlier)
      EXPECT_EQ(readText(out + "/" + name), "of an earlier run") << name;
  }

  /** Runs with arguments that must fail, and returns the one line of its error. */
  std::string
  error(const std::vector<std::string>& arguments, int exit_code)
  {
    const ProgramResult result = runProgram("bundle_icp_reconstruct", arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.err.rfind("bundle_icp_reconstruct: ", 0), 0u) << result.err;
    EXPECT_EQ(result.err.find(": : "), std::string::npos) << result.err;
    expectEarlierResults();
    return result.err;
  }

  std::string
  failure(const std::vector<std::string>& options = {})
  {
    std::vector<std::string> arguments = {scan, "-o", out};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return error(arguments, 1);
  }

  std::string
  misuse(const std::vector<std::string>& options)
  {
    std::vector<std::string> arguments = {scan, "-o", out};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return error(arguments, 2);
  }
};

/** While it lives no file of this process and its children can grow beyond a size: what
 * a full disk looks like to a program. */
class FileSizeLimit {
public:
  explicit FileSizeLimit(rlim_t bytes)
  {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN); // writing then fails with EFBIG
    getrlimit(RLIMIT_FSIZE, &old_limit_);
    const rlimit limit{bytes, old_limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }

  ~FileSizeLimit()
  {
    setrlimit(RLIMIT_FSIZE, &old_limit_);
    std::signal(SIGXFSZ, old_handler_);
  }

private:
  void (*old_handler_)(int);
  rlimit old_limit_{};
};

} // namespace

TEST_F(ReconstructFailure, FolderMissingEmptyOrUnknown)
{
  EXPECT_CONTAINS(error({folder.path("absent"), "-o", out}, 1), "absent: no such folder");
  EXPECT_CONTAINS(error({scan + "/rgb.txt", "-o", out}, 1), "rgb.txt: is not a folder");
  fs::create_directories(folder.path("empty"));
  EXPECT_CONTAINS(error({folder.path("empty"), "-o", out}, 1), "empty: the folder is empty");
  const ProgramResult unknown = runProgram("bundle_icp_reconstruct", {folder.path(), "-o", out});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_CONTAINS(unknown.err, "unknown format, but its folder " + scan);
  EXPECT_CONTAINS(unknown.err, "\n  bundle_icp_reconstruct " + folder.path() + " -o result\n");
}

TEST_F(ReconstructFailure, ARecordingThatCannotBeReadMakesNoFolder)
{
  error({folder.path("absent"), "-o", folder.path("new")}, 1);
  EXPECT_FALSE(fs::exists(folder.path("new")));
}

TEST_F(ReconstructFailure, AllImagesTruncated)
{
  for (int i = 0; i < 3; ++i)
    recordings::truncate(scan + "/rgb/" + std::to_string(i) + ".png", 0.7);
  EXPECT_CONTAINS(failure(), "rgb/0.png: the image is truncated");
}

TEST_F(ReconstructFailure, AllImagesCorrupt)
{
  for (int i = 0; i < 3; ++i)
    writeText(scan + "/depth/" + std::to_string(i) + ".png", "not an image");
  EXPECT_CONTAINS(failure(), "depth/0.png: cannot be decoded as an image");
}

TEST_F(ReconstructFailure, ColourImageInPlaceOfDepth)
{
  writeText(scan + "/depth.txt", "0 rgb/0.png\n0.1 rgb/1.png\n");
  EXPECT_CONTAINS(failure(), "rgb/0.png: a colour image where depth is expected");
}

TEST_F(ReconstructFailure, EightBitDepth)
{
  for (int i = 0; i < 3; ++i)
    recordings::writeImage(scan + "/depth/" + std::to_string(i) + ".png",
                           cv::Mat(48, 64, CV_8UC1, cv::Scalar(9)));
  EXPECT_CONTAINS(failure(), "depth/0.png: 8-bit depth");
}

TEST_F(ReconstructFailure, SizesThatDiffer)
{
  for (int i = 0; i < 3; ++i)
    recordings::writeImage(scan + "/depth/" + std::to_string(i) + ".png",
                           recordings::depth(5000, {32, 32}));
  const std::string message = failure();
  EXPECT_CONTAINS(message, "depth/0.png: depth of 32x32");
  EXPECT_CONTAINS(message, "has 64x48");
}

TEST_F(ReconstructFailure, NoOverlapInTime)
{
  writeText(scan + "/depth.txt", "100.0 depth/0.png\n100.1 depth/1.png\n");
  EXPECT_CONTAINS(failure(), "scan: no overlap in time");
}

TEST_F(ReconstructFailure, IntrinsicsImpossibleOrUnknown)
{
  EXPECT_CONTAINS(failure({"--intrinsics", "0,60,32,24"}),
                  "impossible camera intrinsics: focal length");
  writeText(scan + "/intrinsics.txt", "60 60 -500 24\n");
  EXPECT_CONTAINS(failure(), "intrinsics.txt");
  writeText(scan + "/intrinsics.txt", "60 60 nan 24\n");
  EXPECT_CONTAINS(failure(), "intrinsics.txt:1: 'nan'");
  fs::remove(scan + "/intrinsics.txt");
  EXPECT_CONTAINS(failure(), "intrinsics are unknown");
}

TEST_F(ReconstructFailure, PosesThatAreNotRigidAreNotATruth)
{
  const std::string place = folder.path("seven_scenes");
  recordings::writeSevenScenesFrame(place, 0, recordings::color(0), recordings::depth(1000));
  writeText(place + "/camera-intrinsics.txt", "60 0 32\n0 60 24\n0 0 1\n");
  writeText(folder.path("estimate.txt"), "0 0 0 0 0 0 0 1\n");
  for (const std::string first_row : {"2 0 0 0", "nan 0 0 0"}) {
    writeText(place + "/frame-000000.pose.txt", first_row + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    const ProgramResult result =
        runProgram("bundle_icp_evaluate", {place, folder.path("estimate.txt")});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_CONTAINS(result.err, "seven_scenes: the recording holds no poses");
    EXPECT_CONTAINS(result.err, "frame-000000.pose.txt:");
  }
}

TEST_F(ReconstructFailure, OutputThatCannotBeWritten)
{
  // Root may write anywhere but below what is no folder.
  const std::string file = scan + "/rgb.txt", before = readText(file);
  EXPECT_CONTAINS(error({scan, "-o", file}, 1), "rgb.txt: cannot be made a folder");
  EXPECT_CONTAINS(error({scan, "-o", file + "/out"}, 1),
                  "rgb.txt/out: cannot be made a folder: Not a directory");
  EXPECT_CONTAINS(error({scan, "-o", "/proc/out"}, 1), "/proc/out: cannot be made a folder");
  EXPECT_EQ(readText(file), before);
}

TEST_F(ReconstructFailure, FullDisk)
{
  fs::remove_all(scan);
  simulate();
  ProgramResult result;
  {
    const FileSizeLimit limit(500);
    result = reconstruct({"--max-frames", "4", "--no-mesh"});
  }
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_CONTAINS(result.err, out + "/scan.db: cannot be read or written: File too large");
  expectEarlierResults();
  // With features and matches of an earlier run.
  const std::string other = folder.path("other");
  ASSERT_EQ(runProgram("bundle_icp_reconstruct",
                       {scan, "-o", other, "--max-frames", "4", "--no-mesh", "-q"})
                .exit_code,
            0);
  fs::copy_file(other + "/scan.db", out + "/scan.db", fs::copy_option::overwrite_if_exists);
  const std::vector<std::pair<rlim_t, std::string>> first_too_large = {{500, "calibration.json"},
                                                                       {20000, "trajectory.png"}};
  for (const auto& [bytes, file] : first_too_large) {
    {
      const FileSizeLimit limit(bytes);
      result = reconstruct({"--max-frames", "4", "--no-mesh"});
    }
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.err, "bundle_icp_reconstruct: " + out + "/" + file +
                              ": cannot be written, is the disk full?\n");
    expectEarlierResults();
  }
  EXPECT_EQ(reconstruct({"--max-frames", "4", "--no-mesh"}).exit_code, 0);
  // What this run does not make would pass for a part of it.
  EXPECT_EQ(namesIn(out),
            (std::set<std::string>{"calibration.json", "report.json", "scan.db", "sparse.ply",
                                   "trajectory.png", "trajectory.txt"}));
  EXPECT_NE(readText(out + "/sparse.ply"), "of an earlier run");
}

TEST_F(ReconstructFailure, TargetsThatAreNoFiles)
{
  fs::remove(out + "/mesh.ply");
  fs::create_directory(out + "/mesh.ply");
  const ProgramResult result = reconstruct();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err,
            "bundle_icp_reconstruct: " + out + "/mesh.ply: cannot be written: it is a folder\n");
  fs::remove(out + "/mesh.ply");
  writeText(out + "/mesh.ply", "of an earlier run");
  expectEarlierResults();
}

TEST_F(ReconstructFailure, StandardOutputThatIsClosedOrFull)
{
  fs::remove_all(scan);
  simulate();
  const std::string program = std::string(BUNDLE_ICP_PROGRAM_FOLDER) + "/bundle_icp_reconstruct '" +
                              scan + "' -o '" + out + "' -q --no-mesh --max-frames 4 2>'" + out +
                              ".err' ";
  for (const char* const where : {">&-", ">/dev/full"}) {
    EXPECT_EQ(WEXITSTATUS(std::system((program + where).c_str())), 1) << where;
    EXPECT_CONTAINS(readText(out + ".err"), "standard output cannot be written");
    EXPECT_EQ(readText(out + "/trajectory.txt").find("verdict"), std::string::npos);
  }
}

TEST_F(ReconstructFailure, ASignalStopsARunThatLeavesNothing)
{
  fs::remove_all(scan);
  simulate();
  const std::string program = std::string(BUNDLE_ICP_PROGRAM_FOLDER) + "/bundle_icp_reconstruct";
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove(out + ".err");
    const pid_t child = fork();
    if (child == 0) {
      std::freopen((out + ".err").c_str(), "w", stderr);
      std::signal(signal, SIG_DFL);
      execl(program.c_str(), program.c_str(), scan.c_str(), "-o", out.c_str(), "--voxel-size",
            "0.002", nullptr);
    }
    while (readText(out + ".err").find("features") == std::string::npos &&
           waitpid(child, nullptr, WNOHANG) == 0)
      usleep(2000);
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 1);
    EXPECT_CONTAINS(readText(out + ".err"), "stopped by a signal");
    EXPECT_CONTAINS(readText(out + ".err"), "/out is as it was, but for scan.db");
    expectEarlierResults();
  }
}

TEST_F(ReconstructFailure, UnrelatedFramesFailWithAReasonEach)
{
  const ProgramResult result = reconstruct();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_CONTAINS(result.err, "scan: no two frames could be connected");
  for (const char* const name : {"rgb/0.png", "rgb/1.png", "rgb/2.png"})
    EXPECT_CONTAINS(result.err, name);
  EXPECT_CONTAINS(result.err, "matches with it");
  expectEarlierResults();
}

TEST_F(ReconstructFailure, WhatTheCheckFoundIsSaidWhenNothingIsConnected)
{
  for (const char* const name : {"/depth/0.png", "/depth/1.png", "/depth/2.png"})
    recordings::writeImage(scan + name, recordings::depth(0));
  const ProgramResult result = reconstruct();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_CONTAINS(result.err, "fault: none of the 3 frames that were looked at has depth");
  expectEarlierResults();
}

TEST_F(ReconstructFailure, WrongUsage)
{
  EXPECT_CONTAINS(error({}, 2), "expected SCAN... -o OUT");
  EXPECT_CONTAINS(error({scan}, 2), "expected SCAN... -o OUT");
  EXPECT_CONTAINS(error({"-o", out}, 2), "expected SCAN... -o OUT");
  const std::string absent = folder.path("absent");
  EXPECT_CONTAINS(error({scan, absent, "-o", out}, 1), "absent: no such folder");
  for (const std::vector<std::string>& alone : std::vector<std::vector<std::string>>{
           {"--method", "f2m_icp"}, {"--moving", "object"}, {"--poses", "recording"}}) {
    std::vector<std::string> arguments = alone;
    arguments.insert(arguments.end(), {scan, absent, "-o", out});
    EXPECT_CONTAINS(error(arguments, 2), "only with one SCAN");
  }
  EXPECT_CONTAINS(misuse({"--unknown"}), "--unknown");
  EXPECT_CONTAINS(misuse({"--roi", "1,2,3"}), "--roi 1,2,3: expected x0,y0,z0,x1,y1,z1");
  EXPECT_CONTAINS(misuse({"--mesh-format", "ply,dae"}), "unknown mesh format 'dae'");
  EXPECT_CONTAINS(misuse({"--fill-holes", "-1"}), "max_hole_perimeter -1");
  EXPECT_CONTAINS(misuse({"--decimate-error", "-1"}), "max_error -1");
  EXPECT_CONTAINS(misuse({"--smooth", "-1"}), "iterations -1");
  EXPECT_CONTAINS(misuse({"--min-component", "-1"}), "min_component_area -1");
  EXPECT_CONTAINS(misuse({"--roi", "1,0,0,0,1,1"}), "with x0 < x1");
  EXPECT_CONTAINS(misuse({"--roi", "0,0,0,1,1,nan"}), "--roi");
  EXPECT_CONTAINS(misuse({"--roi", "1,2,3,1,1,1,0,0,0,2"}), "a quaternion of length 1");
  EXPECT_CONTAINS(misuse({"--roi", "1,2,3,1,0,1,0,0,0,1"}), "sx, sy and sz above 0");
  EXPECT_CONTAINS(misuse({"--roi", "subject"}), "or object");
  EXPECT_CONTAINS(misuse({"--min-depth", "6"}), "depth range 6 to 5 m");
  EXPECT_CONTAINS(misuse({"--method", "best"}), "--method best: known");
  EXPECT_CONTAINS(misuse({"--matching", "best"}), "--matching best: known are exact and kdtree");
  EXPECT_CONTAINS(misuse({"--device", "abacus"}), "--device abacus: known");
  EXPECT_CONTAINS(misuse({"--solver", "abacus"}),
                  "--solver abacus: known are auto, ceres and schur");
  EXPECT_CONTAINS(misuse({"--voxel-size", "0"}), "voxel_size");
  EXPECT_CONTAINS(misuse({"--voxel-size", "small"}), "--voxel-size");
  EXPECT_CONTAINS(misuse({"--threads=-1"}), "num_threads");
  for (const std::string size : {"0.5", "G", "1K", "1GB", "nanG", "much"})
    EXPECT_CONTAINS(misuse({"--memory", size}),
                    "--memory " + size + ": expected a size such as 500M or 0.5G");
  for (const std::string size : {"0M", "0.9M", "1e9G"})
    EXPECT_CONTAINS(misuse({"--memory", size}), "--memory " + size + ": expected 1M to 1000000G");
  EXPECT_CONTAINS(misuse({"--memory=-1G"}), "--memory -1G: expected 1M to 1000000G");
  EXPECT_CONTAINS(misuse({"--stride", "0"}), "stride must be at least 1");
  EXPECT_CONTAINS(misuse({"--stride=-1"}), "--stride -1");
  EXPECT_CONTAINS(misuse({"--max-frames", "-1"}), "--max-frames -1");
  EXPECT_CONTAINS(misuse({"--intrinsics", "60,60"}), "expected fx,fy,cx,cy");
  EXPECT_CONTAINS(misuse({"--depth-scale", "0"}), "depth scale");
  EXPECT_CONTAINS(misuse({"--depth-intrinsics", "60,60"}),
                  "--depth-intrinsics 60,60: expected fx,fy,cx,cy");
}
