// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "reconstruct_arguments.h"

#include "scan_arguments.h"
#include "several_scans.h"

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>
#include <boost/program_options.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <sstream>

namespace po = boost::program_options;

namespace bundle_icp {
namespace {

/** Numbers separated by commas; empty when the text has another form. */
std::vector<double>
parseNumbers(const std::string& text)
{
  std::istringstream stream(text);
  std::vector<double> numbers(1);
  if (!(stream >> numbers[0]))
    return {};
  for (char comma = 0; stream >> comma;) {
    numbers.emplace_back();
    if (comma != ',' || !(stream >> numbers.back()))
      return {};
  }
  return numbers;
}

/** Bytes of a size such as 500M or 0.5G. */
std::size_t
parseMemory(const std::string& text)
{
  constexpr double mebibyte = 1 << 20, most = 1e6 * 1024;
  std::istringstream stream(text);
  double number = 0;
  std::string unit;
  if (!(stream >> number >> unit) || !stream.eof() || (unit != "M" && unit != "G"))
    throw UsageError("--memory " + text +
                     ": expected a size such as 500M or 0.5G (M: 2^20 bytes, G: 2^30 bytes)");
  const double mebibytes = unit == "G" ? 1024 * number : number;
  if (!(mebibytes >= 1 && mebibytes <= most))
    throw UsageError("--memory " + text + ": expected 1M to 1000000G");
  return std::size_t(mebibytes * mebibyte);
}

OrientedBox
parseRegion(const std::string& text)
{
  const std::vector<double> v = parseNumbers(text);
  if (v.size() == 6) {
    const Eigen::AlignedBox3d box(Eigen::Vector3d(v[0], v[1], v[2]),
                                  Eigen::Vector3d(v[3], v[4], v[5]));
    if (box.isEmpty())
      throw UsageError("--roi " + text + ": expected x0,y0,z0,x1,y1,z1 with x0 < x1 and so on");
    return box;
  }
  if (v.size() != 10)
    throw UsageError("--roi " + text +
                     ": expected x0,y0,z0,x1,y1,z1 or "
                     "cx,cy,cz,sx,sy,sz,qx,qy,qz,qw or object");
  const Eigen::Quaterniond turn(v[9], v[6], v[7], v[8]);
  if (!(std::abs(turn.norm() - 1) < 1e-3))
    throw UsageError("--roi " + text + ": expected a quaternion of length 1 as qx,qy,qz,qw");
  OrientedBox box(Pose(turn.normalized()), {v[3], v[4], v[5]});
  box.world_from_box.pretranslate(Eigen::Vector3d(v[0], v[1], v[2]));
  if (!(box.size.array() > 0).all())
    throw UsageError("--roi " + text + ": expected sx, sy and sz above 0");
  return box;
}

/** Options of the surface and of its mesh. */
void
describeSurface(ReconstructionOptions& options, po::options_description& run)
{
  auto add = run.add_options();
  add("voxel-size",
      po::value(&options.volume.voxel_size)->value_name("M")->default_value(0.005, "0.005"),
      "edge of a voxel of the surface [m]");
  add("truncation", po::value<double>()->value_name("M"),
      "truncation of the signed distance [m]; default: 8 voxels, at least 0.012, at most 100 "
      "voxels");
  add("roi", po::value<std::string>()->value_name("BOX"),
      "box that limits the surface [m], in the world frame: "
      "x0,y0,z0,x1,y1,z1 (corners), or cx,cy,cz,sx,sy,sz,qx,qy,qz,qw (centre, lengths of the "
      "edges, orientation of a turned box), or object: the object on the dominant plane that "
      "most frames look at, with 2 cm around it; default: everything");
  add("min-depth", po::value(&options.volume.min_depth)->value_name("M")->default_value(0.1, "0.1"),
      "nearer depth is left out of the surface [m]");
  add("max-depth", po::value(&options.volume.max_depth)->value_name("M")->default_value(5.0, "5"),
      "farther depth is left out of the surface [m]");
  add("no-mesh", "write poses and sparse model only");
  add("next",
      "suggest at most ten views that would close the largest holes of the surface, or connect "
      "the parts of the scan: in report.json, and as pictures next_01.png and so on, what is "
      "missing in magenta; not with --no-mesh");
  add("mesh-format", po::value<std::string>()->value_name("LIST")->default_value("ply"),
      "formats of the mesh files, from ply,obj,stl");
  add("smooth",
      po::value(&options.mesh.smoothing.iterations)
          ->value_name("N")
          ->default_value(options.mesh.smoothing.iterations),
      "number of passes that remove noise from the mesh: each moves vertices towards the surface "
      "of their neighbours and keeps steps larger than the noise; 0 = none");
  add("min-component",
      po::value(&options.mesh.cleaning.min_component_area)
          ->value_name("M2")
          ->default_value(0.002, "0.002"),
      "separate pieces of the mesh with less area are removed [m^2]; 0 = none");
  add("fill-holes",
      po::value(&options.mesh.cleaning.max_hole_perimeter)->value_name("M")->default_value(0),
      "holes of at most 1000 edges whose boundary is at most this long [m] are closed; 0 = none");
  add("decimate",
      po::value(&options.mesh.decimation.max_triangles)->value_name("N")->default_value(0),
      "edges are collapsed until the mesh has this many triangles; 0 = no limit");
  add("decimate-error",
      po::value(&options.mesh.decimation.max_error)->value_name("M")->default_value(0),
      "edges are collapsed as long as every vertex of the old mesh stays this close to the new "
      "mesh [m]; 0 = no limit");
}

/** Options of bundle_icp_reconstruct that bundle_icp_merge does not have. */
void
describeScan(ReconstructArguments& arguments, po::options_description& run)
{
  auto add = run.add_options();
  add("add", po::bool_switch(&arguments.is_added),
      "SCAN is added to the recordings that the result in OUT was made from: as if all "
      "were named, with the options of this run");
  add("live", po::bool_switch(&arguments.is_live),
      "play SCAN by its stamps as if one scanned now: of frames that come while one is "
      "worked on the last one alone waits; OUT/trajectory_live.txt has the poses as they "
      "were known when the frames came, the other files are made at the end, from the "
      "frames played");
}

/** \param is_merge whether the arguments name results, not recordings */
po::options_description
describe(ReconstructArguments& arguments, bool is_merge)
{
  ReconstructionOptions& options = arguments.reconstruction;
  po::options_description run("Reconstruction");
  run.add_options()("output,o", po::value(&arguments.output)->value_name("OUT"),
                    "folder for the results, made if needed (required)");
  describeSurface(options, run);
  if (!is_merge)
    describeScan(arguments, run);
  auto add_compared = run.add_options();
  add_compared("method",
               po::value(&arguments.method)->value_name("NAME")->default_value("bundle_icp"),
               "how poses are estimated: bundle_icp, or a method to compare it with: rgbd_sfm "
               "(structure from motion with measured depth, no ICP), visual_icp (frame-to-model "
               "tracking that starts from matched features), f2m_icp (depth alone, as "
               "KinectFusion)");
  add_compared("moving", po::value(&arguments.moving)->value_name("PART")->default_value("camera"),
               "what moves, and what poses and surface are those of: camera, or object: a thing "
               "before a camera that stands still, on a turntable or in hands; then the "
               "surroundings are left out, and poses are relative to the thing");
  add_compared("max-features",
               po::value(&options.features.max_features)
                   ->value_name("N")
                   ->default_value(options.features.max_features),
               "SIFT features per frame");
  add_compared("solver", po::value(&arguments.solver)->value_name("NAME")->default_value("auto"),
               "solver of bundle adjustments: ceres (Ceres Solver, one thread), schur (the "
               "library's own), or auto (the faster one)");
  add_compared("matching",
               po::value(&arguments.matching)->value_name("NAME")->default_value("exact"),
               "how features are compared: exact, or kdtree, which misses some matches and is "
               "slower with up to at least 20,000 features per frame; both give the same result "
               "in every run");
  add_compared("threads", po::value(&options.num_threads)->value_name("N")->default_value(0),
               "0 = all");
  add_compared("memory", po::value(&arguments.memory)->value_name("SIZE"),
               "memory to do with, such as 500M or 2G (M: 2^20 bytes, G: 2^30 bytes): reduced "
               "depth images and descriptors, most of what a frame takes, lie in a file without a "
               "name in OUT beyond three eighths of it; matches, points and the surface are not "
               "bounded; default: half of what is free");
  add_compared("device", po::value(&arguments.device)->value_name("NAME")->default_value("auto"),
               "device that computes: cpu, or auto, which is the same for now");
  add_compared(
      "fresh", po::bool_switch(&arguments.is_fresh),
      "find all features, matches and poses anew; without it those of an earlier run are taken "
      "from OUT/scan.db, where images, camera and options are the same");
  add_compared("quiet,q", po::bool_switch(&arguments.is_quiet), "no progress");
  add_compared("help,h", "print this text");
  add_compared("version", "print the version");
  return po::options_description()
      .add(describeRecording(arguments.dataset))
      .add(describeCalibration(arguments.calibration))
      .add(describePoses(arguments.poses))
      .add(run);
}

void
printHelp(const po::options_description& visible)
{
  std::cout
      << "Usage: bundle_icp_reconstruct SCAN... -o OUT [options]\n\n"
         "Turns a recording of a hand-held RGB-D camera into OUT/trajectory.txt (camera poses,\n"
         "TUM format, metres), OUT/sparse.ply (points), OUT/mesh.ply (coloured surface),\n"
         "OUT/report.json (outcome of each frame), OUT/calibration.json (corrections to the\n"
         "camera) and the pictures OUT/mesh.png and OUT/trajectory.png. OUT/scan.db keeps\n"
         "features, matches and poses: after a run that was stopped or killed, the same command\n"
         "goes on with them; COLMAP opens it.\n"
         "SCAN is a recording in one of the formats of docs/recordings.md: TUM RGB-D, 7-Scenes,\n"
         "ScanNet, Open3D, Stray Scanner, Polycam, nerfstudio, PCL clouds, or folders of images.\n"
         "Several recordings of one place are joined to one scan.\n"
         "The world frame is the camera frame of the earliest registered frame: x right, y down,\n"
         "z forward; with --poses it is that of the poses.\n"
         "Exit codes: 0 = done, verdict good or usable; 1 = failed; 2 = wrong usage; 3 = done and\n"
         "written, but the verdict is doubtful: the last lines say why and what to do.\n"
      << visible;
}

void
printMergeHelp(const po::options_description& visible)
{
  std::cout
      << "Usage: bundle_icp_merge RESULT RESULT... -o OUT [options]\n\n"
         "Joins results of bundle_icp_reconstruct to one: the recordings that they were made\n"
         "from are matched with each other and reconstructed as one scan, with the options of\n"
         "this run. Features, and matches within each result, are taken from its scan.db. The\n"
         "results stay as they are. Files and exit codes are those of bundle_icp_reconstruct.\n"
      << visible;
}

void
applyValues(const po::variables_map& values, ReconstructArguments& arguments)
{
  TSDFOptions& volume = arguments.reconstruction.volume;
  volume.truncation = values.count("truncation") ? values["truncation"].as<double>()
                                                 : std::min(100 * volume.voxel_size,
                                                            std::max(8 * volume.voxel_size, 0.012));
  arguments.reconstruction.make_mesh = !values.count("no-mesh");
  if (values.count("next")) {
    if (!arguments.reconstruction.make_mesh)
      throw UsageError("--next: not with --no-mesh, as the mesh shows where surface is missing");
    arguments.reconstruction.next_views.emplace();
  }
  if (values.count("roi")) {
    const std::string text = values["roi"].as<std::string>();
    if (text == "object")
      arguments.reconstruction.object.emplace();
    else
      volume.region = parseRegion(text);
  }
  boost::split(arguments.reconstruction.mesh_formats, values["mesh-format"].as<std::string>(),
               boost::is_any_of(","));
  applyRecording(values, arguments.dataset);
  const auto method = parseReconstructionMethod(arguments.method);
  if (!method)
    throw UsageError("--method " + arguments.method +
                     ": known are bundle_icp, rgbd_sfm, visual_icp and f2m_icp");
  arguments.reconstruction.method = *method;
  if (arguments.moving != "camera" && arguments.moving != "object")
    throw UsageError("--moving " + arguments.moving + ": known are camera and object");
  if (arguments.moving == "object")
    arguments.reconstruction.moving = MovingPart::OBJECT;
  const auto matching = parseMatchingBackend(arguments.matching);
  if (!matching)
    throw UsageError("--matching " + arguments.matching + ": known are exact and kdtree");
  arguments.reconstruction.graph.matching.backend = *matching;
  arguments.reconstruction.tracking.matching.backend = *matching;
  if (!arguments.calibration.file.empty() && *method != ReconstructionMethod::BUNDLE_ICP)
    throw UsageError("--calibration: only the method bundle_icp applies a calibration");
  const std::map<std::string, AdjustmentSolver> solvers{{"auto", AdjustmentSolver::AUTO},
                                                        {"ceres", AdjustmentSolver::CERES},
                                                        {"schur", AdjustmentSolver::SCHUR}};
  const auto solver = solvers.find(arguments.solver);
  if (solver == solvers.end())
    throw UsageError("--solver " + arguments.solver + ": known are auto, ceres and schur");
  arguments.reconstruction.mapper.adjustment.solver = solver->second;
  if (arguments.device != "cpu" && arguments.device != "auto")
    throw UsageError("--device " + arguments.device + ": known are cpu and auto");
  if (values.count("memory"))
    arguments.reconstruction.max_memory = parseMemory(arguments.memory);
  arguments.reconstruction.temporary_folder = arguments.output;
  applyPoses(arguments.poses, arguments.dataset, arguments.reconstruction);
  std::string error;
  if (!arguments.reconstruction.isValid(&error))
    throw UsageError(error);
}

/** What needs one recording. */
void
refuseSeveralScans(const ReconstructArguments& arguments)
{
  if (!(arguments.poses.poses + arguments.poses.prior).empty())
    throw UsageError("--poses and --pose-prior: only with one SCAN, as poses have one world");
  if (arguments.method == "f2m_icp" || arguments.method == "visual_icp")
    throw UsageError("--method " + arguments.method +
                     ": only with one SCAN, as it tracks the camera from frame to frame");
  if (arguments.moving == "object")
    throw UsageError("--moving object: only with one SCAN, whose surroundings stand still");
}

/** What nobody scans by. */
void
refuseLive(const ReconstructArguments& arguments)
{
  if (arguments.scans.size() > 1)
    throw UsageError("--live: only with one SCAN, as it is played by its stamps");
  if (arguments.method != "bundle_icp")
    throw UsageError("--live: only with --method bundle_icp");
  if (arguments.moving != "camera")
    throw UsageError("--live: only with --moving camera");
  if (!(arguments.poses.poses + arguments.poses.prior).empty())
    throw UsageError("--live: not with --poses or --pose-prior, as no pose is known before");
  if (arguments.dataset.shuffle_seed)
    throw UsageError("--live: not with --shuffle, as frames come in the order of time");
}

/** Puts the recordings that the results were made from in the place of the results. */
void
takeResults(ReconstructArguments& arguments)
{
  namespace fs = boost::filesystem;
  if (arguments.scans.size() < 2)
    throw UsageError("expected RESULT RESULT... -o OUT");
  std::vector<std::string> recordings;
  const fs::path own = arguments.reconstruction.database->path;
  for (const std::string& result : arguments.scans) {
    for (const std::string& recording : recordingsOfResult(result))
      recordings.push_back(recording);
    const fs::path source = fs::path(result) / "scan.db";
    if (fs::exists(source) && !(fs::exists(own) && fs::equivalent(source, own)))
      arguments.reconstruction.database->sources.push_back(source.string());
  }
  arguments.scans = std::move(recordings);
}

/** Puts those of the earlier result before the ones that were named. */
void
takeScans(ReconstructArguments& arguments)
{
  if (!arguments.is_added)
    return;
  if (boost::filesystem::exists(arguments.output))
    prepareResultFolder(arguments.output); // the report may still wait for its place
  std::vector<std::string> scans = recordingsOfResult(arguments.output);
  scans.insert(scans.end(), arguments.scans.begin(), arguments.scans.end());
  arguments.scans = std::move(scans);
}

/** \param is_merge whether the arguments without an option name are results, not recordings
 *  \param take_scans makes recordings of them */
template <class PrintHelp, class TakeScans>
std::optional<ReconstructArguments>
parse(int argc, char** argv, bool is_merge, const PrintHelp& print_help,
      const TakeScans& take_scans)
{
  ReconstructArguments arguments;
  const po::options_description visible = describe(arguments, is_merge);
  const auto values = parseScanArguments(argc, argv, visible, -1, arguments.scans, print_help);
  if (!values)
    return std::nullopt;
  if (arguments.scans.empty() || arguments.output.empty())
    throw UsageError(is_merge ? "expected RESULT RESULT... -o OUT" : "expected SCAN... -o OUT");
  arguments.reconstruction.database = ScanDatabaseOptions{
      (boost::filesystem::path(arguments.output) / "scan.db").string(), arguments.is_fresh};
  take_scans(arguments);
  dropRepeatedScans(arguments.scans);
  if (arguments.scans.size() > 1)
    refuseSeveralScans(arguments);
  applyValues(*values, arguments);
  if (arguments.is_live)
    refuseLive(arguments);
  return arguments;
}

} // namespace

std::optional<ReconstructArguments>
parseReconstructArguments(int argc, char** argv)
{
  return parse(argc, argv, false, printHelp, takeScans);
}

std::optional<ReconstructArguments>
parseMergeArguments(int argc, char** argv)
{
  return parse(argc, argv, true, printMergeHelp, takeResults);
}

} // namespace bundle_icp
