// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Measures a trajectory, and optionally a mesh, against the truth.
#include "estimated_truth.h"
#include "evaluation_figures.h"
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
#include <pcl/common/io.h>
#include <pcl/common/point_tests.h>
#include <pcl/conversions.h>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
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

/** Exit code when figures were printed that say little. */
constexpr int DOUBTFUL_FIGURES = 3;

/** With a true pose for a smaller share of the poses, the figures say little of the others. */
constexpr double FEWEST_WITH_PARTNER = 0.1;

/** A rigid motion alone makes much of the error of fewer poses vanish. */
constexpr std::size_t FEWEST_PARTNERS = 6;

/** Fewer samples of a surface, or fewer true points, are no surface. */
constexpr std::size_t FEWEST_POINTS = 100;

struct Truth {
  Trajectory trajectory;
  std::vector<double> frames; // stamps of all frames; empty = unknown
  std::string warning;        // why the poses are no measured truth; empty = they are
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
                 "poses\n(of poses that a device estimated a warning says so).\n"
                 "TRAJECTORY: estimated poses in TUM format (timestamp tx ty tz qx qy qz qw).\n"
                 "Exit code 3: figures rest on so little that they say next to nothing; a warning "
                 "tells why.\n\n"
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
  if (const std::string what = estimatedTruth(*dataset); !what.empty())
    truth.warning = folder + ": " + what;
  return truth;
}

/** Reads a mesh or points, all of which must be finite. */
pcl::PolygonMesh
readFiniteMesh(const std::string& file)
{
  pcl::PolygonMesh mesh = readMesh(file);
  pcl::PointCloud<pcl::PointXYZ> vertices;
  pcl::fromPCLPointCloud2(mesh.cloud, vertices);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (!pcl::isFinite(vertices[i]))
      throw pcl::IOException(file + ": vertex " + std::to_string(i) + " is not finite");
  return mesh;
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

/** Numbers that can be read but not squared give no figures. */
void
requireFinite(const ErrorStatistics& errors, const std::string& file)
{
  if (!std::isfinite(errors.rmse) || !std::isfinite(errors.max))
    throw pcl::IOException(file + ": the error is not finite: numbers are too large");
}

AbsoluteTrajectoryError
absoluteError(const Trajectory& truth, const Trajectory& estimate, const Arguments& arguments,
              std::vector<std::string>& warnings)
{
  const auto absolute = absoluteTrajectoryError(truth, estimate, arguments.max_difference);
  const std::string of_all = std::to_string(estimate.size()) + " poses lie within " +
                             std::to_string(arguments.max_difference) + " s of a pose of " +
                             arguments.truth;
  if (!absolute)
    throw pcl::IOException(arguments.trajectory + ": fewer than 3 of its " + of_all);
  requireFinite(absolute->translation, arguments.trajectory);
  const std::size_t count = absolute->translation.count;
  if (count < FEWEST_PARTNERS)
    warnings.push_back(arguments.trajectory + ": only " + std::to_string(count) +
                       " poses have a true pose; alignment hides much of so few errors");
  if (double(count) < FEWEST_WITH_PARTNER * double(estimate.size()))
    warnings.push_back(arguments.trajectory + ": only " + std::to_string(count) + " of its " +
                       of_all + "; the figures say little of the others");
  return *absolute;
}

std::optional<RelativePoseError>
relativeError(const Trajectory& truth, const Trajectory& estimate, RelativePoseInterval interval,
              const std::string& file)
{
  const auto error = relativePoseError(truth, estimate, interval);
  if (error) {
    requireFinite(error->translation, file);
    requireFinite(error->rotation, file);
  }
  return error;
}

/** What a call refuses is the fault of a file. */
template <class Call>
auto
naming(const std::string& file, const Call& call)
{
  try {
    return call();
  }
  catch (const pcl::BadArgumentException& error) {
    throw pcl::IOException(file + ": " + error.what());
  }
}

SurfaceError
meshError(const Arguments& arguments, const Pose& truth_from_estimate,
          std::vector<std::string>& warnings)
{
  constexpr double farthest = 1e6; // [m]; coordinates of vertices lose their digits
  if (const double away = truth_from_estimate.translation().norm(); away > farthest)
    throw pcl::IOException(arguments.trajectory + ": its world lies " + std::to_string(away) +
                           " m from that of the true poses; a mesh cannot be compared there");
  SurfaceErrorOptions options = arguments.surface_options;
  options.truth_from_estimate = truth_from_estimate;
  const SurfaceMesh truth =
      naming(arguments.surface, [&] { return toSurfaceMesh(readFiniteMesh(arguments.surface)); });
  const SurfaceError error = naming(arguments.mesh, [&] {
    return compareSurfaces(readFiniteMesh(arguments.mesh), truth, options);
  });
  requireFinite(error.accuracy, arguments.mesh);
  const auto count = [&](const std::string& file, std::size_t number, const char* what) {
    if (number < FEWEST_POINTS)
      warnings.push_back(file + ": has only " + std::to_string(number) + what +
                         "; the figures of the mesh say little");
  };
  count(arguments.mesh, error.accuracy.count, " samples of its area");
  count(arguments.surface, truth.vertices.size(), " points");
  return error;
}

Evaluation
evaluate(const Arguments& arguments)
{
  Truth truth = fs::is_directory(arguments.truth) ? readTruthFolder(arguments.truth)
                                                  : Truth{readTrajectory(arguments.truth), {}, ""};
  if (!arguments.frames.empty())
    truth.frames = readTimestamps(arguments.frames);
  const Trajectory estimate = readTrajectory(arguments.trajectory);
  Evaluation result;
  result.absolute = absoluteError(truth.trajectory, estimate, arguments, result.warnings);
  result.num_poses = estimate.size();
  result.num_frames = std::set<double>(truth.frames.begin(), truth.frames.end()).size();
  result.num_frames_with_pose =
      countFramesWithPose(truth.frames, estimate, arguments.max_difference);
  const auto relative = [&](RelativePoseInterval interval) {
    return relativeError(truth.trajectory, estimate, interval, arguments.trajectory);
  };
  result.frame = relative(RelativePoseInterval::FRAME);
  result.second = relative(RelativePoseInterval::SECOND);
  result.all_pairs = relative(RelativePoseInterval::ALL_PAIRS);
  if (!arguments.mesh.empty())
    result.surface = meshError(arguments, result.absolute.truth_from_estimate, result.warnings);
  result.say_little = !result.warnings.empty();
  if (!truth.warning.empty())
    result.warnings.push_back(truth.warning);
  return result;
}

int
runEvaluation(int argc, char** argv)
{
  const std::optional<Arguments> arguments = parse(argc, argv);
  if (!arguments)
    return 0;
  const Evaluation evaluation = evaluate(*arguments);
  const double complete_within = arguments->surface_options.completeness_distance;
  if (arguments->json)
    printJson(evaluation, complete_within);
  else
    printTable(evaluation, complete_within);
  std::fflush(stdout); // before the warnings, where both go to one place
  for (const std::string& warning : evaluation.warnings)
    std::fprintf(stderr, "bundle_icp_evaluate: warning: %s\n", printable(warning).c_str());
  return evaluation.say_little ? DOUBTFUL_FIGURES : 0;
}

} // namespace

int
main(int argc, char** argv)
{
  return runProgram("bundle_icp_evaluate", runEvaluation, argc, argv);
}
