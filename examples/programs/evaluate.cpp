// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Measures a trajectory, and optionally a mesh, against the truth.
#include "program.h"

#include <bundle_icp/evaluation/surface_error.h>
#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/io/mesh_io.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/io/trajectory.h>
#include <bundle_icp/mesh/surface_mesh.h>

#include <boost/algorithm/string/predicate.hpp>
#include <boost/filesystem.hpp>
#include <boost/program_options.hpp>
#include <nlohmann/json.hpp>
#include <pcl/common/io.h>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <optional>
#include <set>

namespace fs = boost::filesystem;
namespace po = boost::program_options;
using namespace bundle_icp;

namespace {

struct Arguments {
  std::string truth, trajectory, frames, mesh, surface;
  double max_difference = 0.02;
  SurfaceErrorOptions surface_options;
  bool json = false;
};

struct Truth {
  Trajectory trajectory;
  std::vector<double> frames; // stamps of all frames; empty = unknown
};

struct Evaluation {
  std::size_t num_poses = 0, num_frames = 0, num_frames_with_pose = 0;
  AbsoluteTrajectoryError absolute;
  std::optional<RelativePoseError> frame, second, all_pairs;
  std::optional<SurfaceError> surface;
};

po::options_description
describeOptions(Arguments& arguments)
{
  SurfaceErrorOptions& surface = arguments.surface_options;
  po::options_description options("Options");
  auto add = options.add_options();
  add("help,h", "print this text");
  add("version", "print the version");
  add("json", po::bool_switch(&arguments.json), "print JSON instead of a table");
  add("frames", po::value(&arguments.frames)->value_name("LIST"),
      "file whose first column holds the time stamps of all frames [s], for the share of frames "
      "with a pose; default: those of the recording when GROUNDTRUTH is a folder");
  add("max-difference",
      po::value(&arguments.max_difference)->value_name("S")->default_value(0.02, "0.02"),
      "largest time between a pose and its true pose [s]");
  add("mesh", po::value(&arguments.mesh)->value_name("MESH.ply"),
      "mesh in the trajectory's world frame [m]; needs --surface");
  add("surface", po::value(&arguments.surface)->value_name("SURFACE.ply"),
      "points of the true surface in the true world frame [m]");
  add("complete-within",
      po::value(&surface.completeness_distance)->value_name("M")->default_value(0.01, "0.01"),
      "a true point this close to the mesh counts as reconstructed [m]");
  add("threads", po::value(&surface.num_threads)->value_name("N")->default_value(0),
      "threads, 0 = all");
  return options;
}

void
check(Arguments& arguments)
{
  if (arguments.truth.empty() || arguments.trajectory.empty())
    throw UsageError("expected GROUNDTRUTH and TRAJECTORY");
  if (arguments.mesh.empty() != arguments.surface.empty())
    throw UsageError("--mesh and --surface belong together");
  if (!(arguments.max_difference > 0))
    throw UsageError("--max-difference must be positive");
  SurfaceErrorOptions& surface = arguments.surface_options;
  surface.sample_spacing = std::min(0.005, surface.completeness_distance / 2);
  if (std::string error; !surface.isValid(&error))
    throw UsageError(error);
}

// Unset when the user asked for help, which is then printed.
std::optional<Arguments>
parse(int argc, char** argv)
{
  Arguments arguments;
  const po::options_description visible = describeOptions(arguments);
  po::options_description all;
  auto add_positional = all.add(visible).add_options();
  add_positional("truth", po::value(&arguments.truth));
  add_positional("trajectory", po::value(&arguments.trajectory));
  po::positional_options_description positional;
  positional.add("truth", 1).add("trajectory", 1);
  po::variables_map values;
  po::store(po::command_line_parser(argc, argv).options(all).positional(positional).run(), values);
  po::notify(values);
  if (values.count("help")) {
    std::cout << "Usage: bundle_icp_evaluate GROUNDTRUTH TRAJECTORY [options]\n\n"
                 "ATE after rigid alignment without scale, and RPE, as defined by the TUM RGB-D "
                 "benchmark.\n"
                 "GROUNDTRUTH: trajectory in TUM format, or the folder of a recording with "
                 "poses.\n"
                 "TRAJECTORY: estimated poses in TUM format (timestamp tx ty tz qx qy qz qw).\n\n"
              << visible;
    return std::nullopt;
  }
  check(arguments);
  return arguments;
}

// Fault of the first bad file of the files with one pose each; empty without such a file.
std::string
firstBadPose(const std::vector<SkippedFile>& skipped)
{
  for (const SkippedFile& file : skipped)
    if (boost::algorithm::ends_with(file.file, ".pose.txt"))
      return "; " + file.reason;
  return "";
}

Truth
readTruthFolder(const std::string& folder)
{
  // Poses need no calibration: with any intrinsics, a recording without intrinsics opens.
  DatasetOptions options;
  options.intrinsics.emplace();
  options.intrinsics->fx = options.intrinsics->fy = 500;
  const RGBDDataset::Ptr dataset = openDataset(folder, options);
  Truth truth;
  truth.trajectory = dataset->groundTruth();
  const fs::path file = fs::path(folder) / "groundtruth.txt";
  if (truth.trajectory.empty() && fs::exists(file))
    truth.trajectory = readTrajectory(file.string()); // throws the reason
  if (truth.trajectory.empty())
    throw pcl::IOException(folder + ": the recording holds no poses" +
                           firstBadPose(dataset->skipped()));
  for (std::size_t i = 0; i < dataset->size(); ++i)
    truth.frames.push_back(dataset->timestamp(i));
  return truth;
}

SurfaceError
compareSurfaces(const pcl::PolygonMesh& mesh, const SurfaceMesh& truth,
                const SurfaceErrorOptions& options)
{
  pcl::PointCloud<pcl::PointNormal> points;
  points.resize(truth.vertices.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].getVector3fMap() = truth.vertices[i];
    if (!truth.normals.empty())
      points[i].getNormalVector3fMap() = truth.normals[i];
  }
  if (!truth.normals.empty())
    return surfaceError(mesh, points, options);
  pcl::PointCloud<pcl::PointXYZ> places;
  pcl::copyPointCloud(points, places);
  return surfaceError(mesh, places, options);
}

Evaluation
evaluate(const Arguments& arguments)
{
  Truth truth = fs::is_directory(arguments.truth) ? readTruthFolder(arguments.truth)
                                                  : Truth{readTrajectory(arguments.truth), {}};
  if (!arguments.frames.empty())
    truth.frames = readTimestamps(arguments.frames);
  const Trajectory estimate = readTrajectory(arguments.trajectory);
  const auto absolute =
      absoluteTrajectoryError(truth.trajectory, estimate, arguments.max_difference);
  if (!absolute)
    throw pcl::IOException(arguments.trajectory + ": fewer than 3 of its " +
                           std::to_string(estimate.size()) + " poses lie within " +
                           std::to_string(arguments.max_difference) + " s of a pose of " +
                           arguments.truth);
  Evaluation result;
  result.absolute = *absolute;
  result.num_poses = estimate.size();
  result.num_frames = std::set<double>(truth.frames.begin(), truth.frames.end()).size();
  result.num_frames_with_pose =
      countFramesWithPose(truth.frames, estimate, arguments.max_difference);
  const auto relative = [&](RelativePoseInterval interval) {
    return relativePoseError(truth.trajectory, estimate, interval);
  };
  result.frame = relative(RelativePoseInterval::FRAME);
  result.second = relative(RelativePoseInterval::SECOND);
  result.all_pairs = relative(RelativePoseInterval::ALL_PAIRS);
  if (!arguments.mesh.empty()) {
    SurfaceErrorOptions options = arguments.surface_options;
    options.truth_from_estimate = absolute->truth_from_estimate;
    result.surface = compareSurfaces(readMesh(arguments.mesh),
                                     toSurfaceMesh(readMesh(arguments.surface)), options);
  }
  return result;
}

nlohmann::ordered_json
toJson(const ErrorStatistics& s)
{
  return {
      {"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"max", s.max}, {"count", s.count}};
}

nlohmann::ordered_json
toJson(const std::optional<RelativePoseError>& error)
{
  if (!error)
    return nullptr;
  return {{"translation_m", toJson(error->translation)}, {"rotation_rad", toJson(error->rotation)}};
}

void
printJson(const Evaluation& e, const Arguments& arguments)
{
  nlohmann::ordered_json json;
  json["poses"] = e.num_poses;
  json["frames"] = nullptr;
  json["frames_with_pose"] = nullptr;
  json["fraction_with_pose"] = nullptr;
  if (e.num_frames > 0) {
    json["frames"] = e.num_frames;
    json["frames_with_pose"] = e.num_frames_with_pose;
    json["fraction_with_pose"] = double(e.num_frames_with_pose) / double(e.num_frames);
  }
  json["ate_m"] = toJson(e.absolute.translation);
  json["rpe_frame"] = toJson(e.frame);
  json["rpe_second"] = toJson(e.second);
  json["rpe_all_pairs"] = toJson(e.all_pairs);
  if (e.surface) {
    json["mesh_m"] = toJson(e.surface->accuracy);
    json["mesh_completeness"] = e.surface->completeness;
    json["mesh_complete_within_m"] = arguments.surface_options.completeness_distance;
  }
  std::cout << json.dump(2) << "\n";
}

void
printRelative(const char* name, const std::optional<RelativePoseError>& error)
{
  if (error)
    std::printf("RPE %-15s translation rmse %.6f m  rotation rmse %.6f rad  mean %.6f rad"
                "  (%zu pairs)\n",
                name, error->translation.rmse, error->rotation.rmse, error->rotation.mean,
                error->rotation.count);
  else
    std::printf("RPE %-15s not known: fewer than 2 pairs\n", name);
}

void
printTable(const Evaluation& e, const Arguments& arguments)
{
  if (e.num_frames > 0)
    std::printf("frames with a pose  %zu of %zu (%.1f %%)\n", e.num_frames_with_pose, e.num_frames,
                100.0 * e.num_frames_with_pose / e.num_frames);
  else
    std::printf("frames with a pose  not known (%zu poses; give --frames or a folder)\n",
                e.num_poses);
  const ErrorStatistics& ate = e.absolute.translation;
  std::printf("ATE                 rmse %.6f m  mean %.6f m  median %.6f m  max %.6f m"
              "  (%zu pairs)\n",
              ate.rmse, ate.mean, ate.median, ate.max, ate.count);
  printRelative("per frame", e.frame);
  printRelative("per second", e.second);
  printRelative("all pairs", e.all_pairs);
  if (!e.surface)
    return;
  const ErrorStatistics& mesh = e.surface->accuracy;
  std::printf("mesh                mean %.6f m  rmse %.6f m  median %.6f m  max %.6f m"
              "  (%zu samples)\n",
              mesh.mean, mesh.rmse, mesh.median, mesh.max, mesh.count);
  std::printf("mesh completeness   %.1f %% of the surface within %g m\n",
              100 * e.surface->completeness, arguments.surface_options.completeness_distance);
}

int
runEvaluation(int argc, char** argv)
{
  const std::optional<Arguments> arguments = parse(argc, argv);
  if (!arguments)
    return 0;
  const Evaluation evaluation = evaluate(*arguments);
  if (arguments->json)
    printJson(evaluation, *arguments);
  else
    printTable(evaluation, *arguments);
  return 0;
}

} // namespace

int
main(int argc, char** argv)
{
  return runProgram("bundle_icp_evaluate", runEvaluation, argc, argv);
}
