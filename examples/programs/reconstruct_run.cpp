// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "reconstruct_run.h"

#include "live_scan.h"
#include "print_reconstruction.h"

#include <bundle_icp/io/joined_dataset.h>
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/scan/estimate_intrinsics.h>

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <optional>

namespace bundle_icp {
namespace {

/** Exit code of a run whose results are written, but doubtful. */
constexpr int DOUBTFUL_RESULT = 3;

/** Code, matches and points take memory beside what --memory bounds, and so does the surface. */
bool
exceedsMemory(const ReconstructionOptions& options, const ReconstructionResult& result)
{
  return options.max_memory > 0 && result.peak_memory_bytes > options.max_memory;
}

void
printSummary(const ReconstructArguments& arguments, const RGBDDataset& dataset,
             const ReconstructionResult& result)
{
  if (!dataset.skipped().empty())
    std::cerr << dataset.skipped().size() << " files of the recording are missing or have no "
              << "partner, for example "
              << printable(dataset.skipped().front().file + ": " + dataset.skipped().front().reason)
              << "\n";
  const DepthNoise& noise = dataset.camera().depth_noise;
  if (!arguments.is_quiet)
    std::cerr << "sensor: " << sensorName(noise) << ", depth deviates by " << noise.constant
              << " m + " << noise.quadratic << " /m (z - " << noise.offset << " m)^2\n";
  if (!arguments.is_quiet && result.reused.features > 0)
    std::cerr << "of an earlier run: features of " << result.reused.features
              << " frames, matches of " << result.reused.pairs << " pairs"
              << (result.reused.poses ? ", poses" : "") << " (--fresh finds them anew)\n";
  printReasons(result, 3);
  printDoubts(result);
  printCorrections(result);
  printObject(result);
  printMeshReport(result);
  std::cout << result.summary() << "\n";
  printScene(result);
  printNextViews(arguments.reconstruction, result);
  double total = 0;
  for (const auto& [stage, seconds] : result.timing_s) {
    std::cout << stage << " " << std::round(10 * seconds) / 10 << " s, ";
    total += seconds;
  }
  std::cout << "together " << std::round(10 * total) / 10 << " s; peak memory "
            << result.peak_memory_bytes / 1000000 << " MB"
            << (exceedsMemory(arguments.reconstruction, result) ? ", more than --memory" : "")
            << "\n";
  std::cout << "Results are in " << arguments.output << "\n";
  printVerdict(result);
}

/** The scans for messages. */
std::string
scansOf(const ReconstructArguments& arguments)
{
  return boost::algorithm::join(arguments.scans, ", ");
}

/** Opens all scans as one, with the options that follow from their content. */
RGBDDataset::Ptr
openScans(ReconstructArguments& arguments)
{
  ReconstructionOptions& reconstruction = arguments.reconstruction;
  DatasetOptions options = arguments.dataset;
  if (options.field_of_view) // estimated once: they are of one camera
    options = withEstimatedIntrinsics(arguments.scans.front(), options);
  const MapperOptions before = reconstruction.mapper;
  std::vector<RGBDDataset::Ptr> recordings;
  for (const std::string& scan : arguments.scans) {
    reconstruction.mapper = before;
    recordings.push_back(
        openCalibrated(scan, options, arguments.calibration, reconstruction.mapper));
  }
  if (recordings.size() > 1)
    return std::make_shared<JoinedDataset>(std::move(recordings));
  takeRecordedPoses(arguments.poses, arguments.scans.front(), arguments.dataset.max_time_difference,
                    *recordings.front(), reconstruction);
  return recordings.front();
}

/** Takes the folder of the results away again where a run made it and leaves it empty. */
class ResultFolder {
public:
  explicit ResultFolder(const std::string& folder)
  : folder_(folder), was_there_(boost::filesystem::exists(folder))
  {
    prepareResultFolder(folder);
  }
  ~ResultFolder()
  {
    boost::system::error_code ignored; // such as that it is not empty
    if (!was_there_)
      boost::filesystem::remove(folder_, ignored);
  }
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder&
  operator=(const ResultFolder&) = delete;

private:
  const std::string folder_;
  const bool was_there_;
};

/** What a run had done when a signal ended it. */
std::string
stopMessage(const ReconstructArguments& arguments, const ReconstructionResult& result)
{
  const auto registered = std::count_if(result.frames.begin(), result.frames.end(),
                                        [](const FrameReport& frame) { return frame.registered; });
  std::string stages;
  for (const auto& [stage, seconds] : result.timing_s)
    stages += (stages.empty() ? "" : ", ") + stage;
  return "stopped by a signal (stages begun: " + stages + "; " + std::to_string(registered) +
         " of " + std::to_string(result.frames.size()) + " frames had a pose); " +
         arguments.output +
         " is as it was, but for scan.db: the same command goes on with what it holds";
}

} // namespace

int
runReconstruction(ReconstructArguments& arguments)
{
  RGBDDataset::Ptr dataset = openScans(arguments);
  const ResultFolder result_folder(arguments.output);
  ReconstructionResult result;
  {
    const StopOnSignal stop_on_signal;
    ProgressPrinter progress(arguments.is_quiet);
    result = arguments.is_live
                 ? reconstructLive(dataset, arguments.reconstruction, std::ref(progress))
                 : reconstruct(*dataset, arguments.reconstruction, std::ref(progress));
  }
  if (result.status == ReconstructionStatus::STOPPED)
    throw std::runtime_error(stopMessage(arguments, result));
  if (result.status == ReconstructionStatus::NOTHING_REGISTERED) {
    printReasons(result, result.frames.size());
    for (const Finding& finding : findingsAboveNote(result))
      std::cerr << toString(finding) << "\n";
    throw pcl::PCLException(scansOf(arguments) + ": no two frames could be connected");
  }
  if (result.status == ReconstructionStatus::NO_OBJECT)
    throw pcl::PCLException(scansOf(arguments) + ": --roi object: " + result.object->reason);
  writeReconstruction(arguments.output, *dataset, arguments.reconstruction, result);
  printSummary(arguments, *dataset, result);
  return result.verdict() == Verdict::DOUBTFUL ? DOUBTFUL_RESULT : 0;
}

} // namespace bundle_icp
