// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Damages each kind of input file at random and runs the programs on it. A crash, a hang, much
// memory and an error that names no file are bad; a wrong result without a warning is silent.
#include "judge.h"
#include "mutation.h"
#include "program.h"

#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <boost/filesystem.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <regex>
#include <stdexcept>

namespace {

using namespace adversity;
namespace fs = boost::filesystem;

constexpr std::size_t MAX_MEMORY_KIB = 2 << 20;

/** Files of one kind in a recording. */
struct Kind {
  std::string name, format;
  std::string files; ///< regular expression of paths in the folder
  bool is_text = true;
};

const std::vector<Kind> KINDS = {
    {"lists", "tum", R"((rgb|depth)\.txt)"},
    {"intrinsics.txt", "tum", R"(intrinsics\.txt)"},
    {"colour images", "tum", "rgb/.*", false},
    {"depth images", "tum", "depth/.*", false},
    {"intrinsic.json", "open3d", R"(.*\.json)"},
    {"camera-intrinsics.txt", "7-scenes", R"(camera-intrinsics\.txt)"},
    {"odometry.csv", "stray-scanner", R"(odometry\.csv)"},
    {"camera_matrix.csv", "stray-scanner", R"(camera_matrix\.csv)"},
    {"cameras of Polycam", "polycam", R"(.*cameras/.*\.json)"},
    {"transforms.json", "nerfstudio", R"(transforms\.json)"},
    {"intrinsics of ScanNet", "scannet", "intrinsic/.*"},
    {"x.sens", "sens", R"(.*\.sens)", false},
    {"x.pcd", "pcd", R"(.*\.pcd)", false},
};

/** What became of a mutant. */
struct Fate {
  std::string kind;   ///< right, refused, warned, SILENT or BAD
  std::string reason; ///< of the last two
};

/** A clean recording and what the program makes of it. */
struct Clean {
  std::string folder;
  Places places;
  double error = 0;   ///< [m]
  double seconds = 0; ///< of the run
};

/** Limits of a run, as text of the shell: 1.5 times as long as the clean one, and 2 s. */
std::string
limits(double clean_seconds)
{
  return "ulimit -v " + std::to_string(MAX_MEMORY_KIB) + "; timeout --signal=KILL " +
         std::to_string(1.5 * clean_seconds + 2) + " ";
}

/** How a run can be bad whatever it read; empty when it is not. */
std::string
faultOf(int exit_code, const std::string& said, const std::string& folder)
{
  if (exit_code == 137)
    return "killed after its time";
  if (exit_code != 0 && exit_code != 1 && exit_code != 3)
    return "exit code " + std::to_string(exit_code);
  if (said.find("not enough memory") != std::string::npos)
    return "more than 2 GiB of memory";
  if (exit_code == 1 && said.find(folder) == std::string::npos)
    return "no file is named";
  return "";
}

class Mutants {
public:
  Mutants(std::size_t count, unsigned seed) : count_(count), seed_(seed) {}

  /** \return true when no mutant was bad. */
  bool
  run()
  {
    std::printf("%-24s %7s %7s %7s %7s %7s\n", "input", "right", "refused", "warned", "SILENT",
                "BAD");
    for (const Kind& kind : KINDS) {
      const Clean& clean = cleanRecording(kind.format);
      runKind(kind.name, filesOf(clean.folder, kind), kind.is_text,
              [&] { return reconstructed(clean); });
    }
    runEvaluation();
    return !is_bad_;
  }

private:
  static std::vector<std::string>
  filesOf(const std::string& folder, const Kind& kind)
  {
    std::vector<std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
      const std::string path = entry.path().string();
      if (fs::is_regular_file(entry.path()) &&
          std::regex_match(path.substr(folder.size() + 1), std::regex(kind.files)))
        files.push_back(path);
    }
    std::sort(files.begin(), files.end());
    if (files.empty())
      throw std::runtime_error(folder + " has no file " + kind.files);
    return files;
  }

  const Clean&
  cleanRecording(const std::string& format)
  {
    const auto known = clean_.find(format);
    if (known != clean_.end())
      return known->second;
    bundle_icp::SyntheticScanOptions options;
    options.num_frames = 6;
    options.frame_rate = 5;
    options.width = 160;
    options.height = 120;
    options.focal_length = 131;
    const bundle_icp::SyntheticScan scan(options);
    bundle_icp::SyntheticScanWriteOptions write;
    write.format = format;
    write.surface_spacing = 0;
    Clean clean;
    clean.folder = folder_.path(format);
    bundle_icp::writeSyntheticScan(scan, clean.folder, write);
    const auto dataset = bundle_icp::openDataset(clean.folder);
    for (std::size_t i = 0; i < dataset->size(); ++i)
      clean.places[dataset->name(i).substr(clean.folder.size() + 1)] =
          scan.worldFromCamera(i).translation();
    const auto start = std::chrono::steady_clock::now();
    const Outcome outcome = reconstruct(clean.folder, folder_.path("out"), clean.places, {});
    clean.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (outcome.exit_code != 0 || !outcome.error)
      throw std::runtime_error("the clean recording " + format + " fails: " + outcome.messages);
    clean.error = *outcome.error;
    return clean_[format] = clean;
  }

  /** Damages one of the files at a time, and counts what `run` says. */
  void
  runKind(const std::string& name, const std::vector<std::string>& files, bool is_text,
          const std::function<Fate()>& run)
  {
    std::mt19937 random(seed_);
    std::map<std::string, int> fates;
    for (std::size_t k = 0; k < count_; ++k) {
      const std::string& file = files[random() % files.size()];
      const std::string bytes = readText(file);
      const Mutant mutant = mutate(bytes, is_text, random);
      writeText(file, mutant.bytes);
      const Fate fate = run();
      writeText(file, bytes);
      ++fates[fate.kind];
      if (!fate.reason.empty())
        std::printf("  %s: %s of %s: %s\n", fate.kind.c_str(), mutant.change.c_str(),
                    file.substr(folder_.path().size() + 1).c_str(), fate.reason.c_str());
      is_bad_ = is_bad_ || fate.kind == "BAD";
    }
    std::printf("%-24s %7d %7d %7d %7d %7d\n", name.c_str(), fates["right"], fates["refused"],
                fates["warned"], fates["SILENT"], fates["BAD"]);
    std::fflush(stdout);
  }

  Fate
  reconstructed(const Clean& clean) const
  {
    const std::string out = folder_.path("out");
    fs::remove_all(out);
    Outcome outcome;
    try {
      outcome = reconstruct(clean.folder, out, clean.places, {}, limits(clean.seconds));
    }
    catch (const std::out_of_range&) { // a list names an image in another way
      return {"right", ""};
    }
    catch (const std::exception& error) {
      return {"BAD", error.what()};
    }
    const std::string fault = faultOf(outcome.exit_code, outcome.messages, clean.folder);
    if (!fault.empty())
      return {"BAD", fault};
    if (outcome.exit_code == 1)
      return {"refused", ""};
    if (outcome.error && *outcome.error <= largestError(clean.error))
      return {"right", ""};
    if (outcome.exit_code == 3 || !outcome.messages.empty())
      return {"warned", ""};
    return {"SILENT", outcome.error ? "ATE " + std::to_string(*outcome.error) + " m" : "no ATE"};
  }

  /** A trajectory and a mesh for bundle_icp_evaluate. */
  void
  runEvaluation()
  {
    const std::string truth = cleanRecording("tum").folder + "/groundtruth.txt";
    const std::string place = folder_.path("evaluate"), trajectory = place + "/trajectory.txt",
                      mesh = place + "/mesh.ply", surface = place + "/surface.ply";
    writeText(trajectory, readText(truth));
    writeText(mesh, triangles());
    writeText(surface, triangles());
    const auto run = [&]() -> Fate {
      const ProgramResult result = runProgram(
          "bundle_icp_evaluate",
          {truth, trajectory, "--mesh", mesh, "--surface", surface, "--threads", "1"}, limits(0.1));
      const std::string fault = faultOf(result.exit_code, result.err, place);
      if (!fault.empty())
        return {"BAD", fault + ": " + result.err};
      return {result.exit_code == 0 ? "right" : result.exit_code == 3 ? "warned" : "refused", ""};
    };
    runKind("trajectory", {trajectory}, true, run);
    runKind("PLY as text", {mesh, surface}, true, run);
    bundle_icp::writeMesh(mesh, bundle_icp::readMesh(mesh)); // binary
    runKind("PLY", {mesh}, false, run);
  }

  /** A strip of triangles, as PLY. */
  static std::string
  triangles()
  {
    constexpr int count = 150;
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
                       "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                       std::to_string(count - 2) +
                       "\nproperty list uchar int vertex_indices\nend_header\n";
    for (int i = 0; i < count; ++i)
      text += std::to_string(0.01 * (i / 2)) + (i % 2 ? " 0.1 1.5\n" : " 0.0 1.5\n");
    for (int i = 0; i + 2 < count; ++i)
      text += "3 " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + 2) +
              "\n";
    return text;
  }

  const std::size_t count_;
  const unsigned seed_;
  TemporaryFolder folder_;
  std::map<std::string, Clean> clean_;
  bool is_bad_ = false;
};

} // namespace

int
main(int argc, char** argv)
{
  try {
    const std::size_t count = argc > 1 ? std::stoul(argv[1]) : 300;
    const unsigned seed = argc > 2 ? unsigned(std::stoul(argv[2])) : 1;
    return Mutants(count, seed).run() ? 0 : 1;
  }
  catch (const std::exception& error) {
    std::fprintf(stderr, "bundle_icp_mutants: %s\n", error.what());
    return 2;
  }
}
