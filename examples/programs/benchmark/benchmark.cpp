// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// The methods that the paper compares, side by side on recordings with true poses;
// Bundle ICP without its parts; and all of these with fewer and with blurred frames.
#include "estimated_truth.h"
#include "scan_arguments.h"

#include "blurred_dataset.h"
#include "tables.h"
#include "variants.h"

#include <bundle_icp/io/atomic_file.h>
#include <bundle_icp/reconstruction.h>

#include <boost/algorithm/string.hpp>
#include <boost/filesystem.hpp>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iostream>

namespace fs = boost::filesystem;
namespace po = boost::program_options;
using namespace bundle_icp;

namespace {

struct Arguments {
  std::vector<std::string> scans;
  std::string output;
  DatasetOptions dataset;
  ReconstructionOptions reconstruction;
  std::vector<Variant> variants;
  std::vector<Condition> conditions;
  std::uint64_t seed = 0;
  bool is_quiet = false;
};

template <typename T>
std::vector<T>
parseList(const std::string& option, const std::string& text)
{
  std::vector<std::string> words;
  boost::split(words, text, boost::is_any_of(","));
  std::vector<T> values;
  for (const std::string& word : words)
    try {
      values.push_back(boost::lexical_cast<T>(word));
    }
    catch (const boost::bad_lexical_cast&) {
      throw UsageError("--" + option + " " + text + ": expected numbers separated by commas");
    }
  return values;
}

std::vector<Variant>
chooseMethods(const std::string& text)
{
  std::vector<std::string> names;
  boost::split(names, text, boost::is_any_of(","));
  std::vector<Variant> chosen;
  for (const std::string& name : names) {
    const auto found = std::find_if(comparedMethods().begin(), comparedMethods().end(),
                                    [&name](const Variant& v) { return v.name == name; });
    if (found == comparedMethods().end())
      throw UsageError("--methods " + text +
                       ": known are f2m_icp, visual_icp, rgbd_sfm and bundle_icp");
    chosen.push_back(*found);
  }
  return chosen;
}

/** The conditions of the command line, or the unchanged recording. */
std::vector<Condition>
chooseConditions(const po::variables_map& values)
{
  std::vector<Condition> conditions;
  if (values.count("keep"))
    for (const int keep : parseList<int>("keep", values["keep"].as<std::string>())) {
      if (keep < 1)
        throw UsageError("--keep: each number must be at least 1");
      conditions.push_back({std::size_t(keep), 0});
    }
  if (values.count("blur-fraction"))
    for (const double blur :
         parseList<double>("blur-fraction", values["blur-fraction"].as<std::string>())) {
      if (!(blur >= 0 && blur <= 1))
        throw UsageError("--blur-fraction: each number must lie in 0 ... 1");
      const bool is_known =
          std::any_of(conditions.begin(), conditions.end(),
                      [blur](const Condition& c) { return c.keep == 1 && c.blur == blur; });
      if (!is_known)
        conditions.push_back({1, blur});
    }
  return conditions.empty() ? std::vector<Condition>{{}} : conditions;
}

po::options_description
describeRun(Arguments& arguments)
{
  po::options_description run("Benchmark");
  auto add = run.add_options();
  add("output,o", po::value(&arguments.output)->value_name("OUT"),
      "folder for benchmark.md and benchmark.json, made if needed; default: tables on "
      "the standard output only");
  add("methods",
      po::value<std::string>()->value_name("NAMES")->default_value(
          "f2m_icp,visual_icp,rgbd_sfm,bundle_icp"),
      "methods to run, separated by commas");
  add("ablations", "also run bundle_icp without each of its parts");
  add("keep", po::value<std::string>()->value_name("N,N,..."),
      "run on every N-th frame, for each of these numbers, for example "
      "1,2,3,5,10,15,20");
  add("blur-fraction", po::value<std::string>()->value_name("F,F,..."),
      "run with motion blur in this share (0 to 1) of the colour images, for each of these "
      "numbers, for example 0,0.1,0.2");
  add("seed", po::value(&arguments.seed)->value_name("SEED")->default_value(0),
      "seed of the choice of blurred images and of their blur");
  add("threads",
      po::value(&arguments.reconstruction.num_threads)->value_name("N")->default_value(0),
      "0 = all");
  add("quiet,q", po::bool_switch(&arguments.is_quiet), "no progress");
  add("help,h", "print this text");
  add("version", "print the version");
  return run;
}

void
printHelp(const po::options_description& visible)
{
  std::cout << "Usage: bundle_icp_benchmark SCAN... [options]\n\n"
               "Runs the methods that the paper compares on the same frames and features of each\n"
               "SCAN, a recording with true poses. Prints ATE [m], RPE [m, rad], the share of\n"
               "frames with a pose and the time [s] as Markdown:\n";
  for (const std::vector<Variant>& variants : {comparedMethods(), ablations()})
    for (const Variant& variant : variants)
      std::cout << "  " << variant.name << ": " << variant.description << "\n";
  std::cout << visible;
}

/** \return nothing when help was asked for. */
std::optional<Arguments>
parse(int argc, char** argv)
{
  Arguments arguments;
  const po::options_description visible = po::options_description()
                                              .add(describeRecording(arguments.dataset))
                                              .add(describeRun(arguments));
  const auto values = parseScanArguments(argc, argv, visible, -1, arguments.scans, printHelp);
  if (!values)
    return std::nullopt;
  if (arguments.scans.empty())
    throw UsageError("expected SCAN...");
  applyRecording(*values, arguments.dataset);
  arguments.reconstruction.make_mesh = false;
  if (std::string error; !arguments.reconstruction.isValid(&error))
    throw UsageError(error);
  arguments.variants = chooseMethods((*values)["methods"].as<std::string>());
  if (values->count("ablations"))
    arguments.variants.insert(arguments.variants.end(), ablations().begin(), ablations().end());
  arguments.conditions = chooseConditions(*values);
  return arguments;
}

/** The recording under a condition; --max-frames counts the frames before some are
 * left out. */
RGBDDataset::Ptr
openScan(const std::string& folder, const Condition& condition, const Arguments& arguments)
{
  DatasetOptions options = arguments.dataset;
  options.stride *= condition.keep;
  options.max_frames = (options.max_frames + condition.keep - 1) / condition.keep;
  RGBDDataset::Ptr dataset = openRecording(folder, options);
  if (dataset->groundTruth().empty())
    throw pcl::IOException(folder + ": the recording holds no true poses to compare with");
  if (condition.blur > 0)
    dataset = std::make_shared<BlurredDataset>(dataset, condition.blur, arguments.seed);
  return dataset;
}

ConditionResult
runCondition(const std::string& folder, const Condition& condition, const Arguments& arguments,
             const Trajectory& truth)
{
  ConditionResult result{condition, {}};
  const RGBDDataset::Ptr dataset = openScan(folder, condition, arguments);
  PreparedScan scan(*dataset, arguments.reconstruction);
  for (const Variant& variant : arguments.variants) {
    if (!arguments.is_quiet)
      std::cerr << folder << ", " << toString(condition) << ": " << variant.name << "\n";
    ProgressPrinter progress(arguments.is_quiet);
    result.measurements.push_back(
        measure(scan, variant, arguments.reconstruction, truth, std::ref(progress)));
  }
  return result;
}

void
writeBytes(const std::string& path, const std::string& bytes)
{
  writeAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    if (!(file << bytes).flush())
      throw pcl::IOException(path + ": cannot be written, is the disk full?");
  });
}

/** Writes all results so far, so that a failure does not lose hours of work. */
void
writeResults(const Arguments& arguments, const std::vector<ScanResult>& scans)
{
  if (arguments.output.empty())
    return;
  const std::string prefix = arguments.output + "/";
  writeBytes(prefix + "benchmark.md", toMarkdown(scans, arguments.variants));
  writeBytes(prefix + "benchmark.json", toJson(scans));
}

std::string
folderName(const std::string& path)
{
  const fs::path name = fs::path(path).lexically_normal().filename();
  return name == "." ? fs::path(path).lexically_normal().parent_path().filename().string()
                     : name.string();
}

int
runBenchmark(int argc, char** argv)
{
  const std::optional<Arguments> arguments = parse(argc, argv);
  if (!arguments)
    return 0;
  for (const std::string& scan : arguments->scans) // before hours of work
    openScan(scan, {}, *arguments);
  if (!arguments->output.empty())
    prepareResultFolder(arguments->output);
  std::vector<ScanResult> scans;
  for (const std::string& folder : arguments->scans) {
    // The truth keeps all poses, also when few frames are kept.
    const RGBDDataset::Ptr whole = openScan(folder, {}, *arguments);
    const Trajectory truth = whole->groundTruth();
    scans.push_back({folderName(folder), {}, estimatedTruth(*whole)});
    if (!scans.back().warning.empty())
      std::cerr << "bundle_icp_benchmark: warning: "
                << printable(folder + ": " + scans.back().warning) << "\n";
    for (const Condition& condition : arguments->conditions) {
      scans.back().conditions.push_back(runCondition(folder, condition, *arguments, truth));
      std::cout << scans.back().name << ", " << toString(condition) << "\n\n"
                << toMarkdown(scans.back().conditions.back()) << std::endl;
      writeResults(*arguments, scans);
    }
  }
  if (!arguments->output.empty())
    std::cout << "Results are in " << arguments->output << "\n";
  return 0;
}

} // namespace

int
main(int argc, char** argv)
{
  return runProgram("bundle_icp_benchmark", runBenchmark, argc, argv);
}
