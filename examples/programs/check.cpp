// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Says what is wrong with a recording, before it is reconstructed.
#include "scan_arguments.h"

#include <bundle_icp/scan/check.h>

#include <iostream>

namespace po = boost::program_options;
using namespace bundle_icp;

namespace {

void
printHelp(const po::options_description& options)
{
  std::cout
      << "Usage: bundle_icp_check SCAN [options]\n\n"
         "Looks at a recording before it is reconstructed: what is assumed about it, and what "
         "contradicts\nitself. Prints one finding a line: note, warning or fault. Exit codes: "
         "0 no fault, 1 the recording\ncannot be read, 2 wrong usage, 3 at least one "
         "fault.\n\n"
      << options;
}

int
run(int argc, char** argv)
{
  DatasetOptions dataset_options;
  CheckOptions check;
  po::options_description general("General");
  auto add = general.add_options();
  add("help,h", "print this text");
  add("version", "print the version");
  add("frames", po::value(&check.num_frames)->value_name("N")->default_value(check.num_frames),
      "frames that are read; fewer where images have more than 640x480 pixels");
  add("threads", po::value(&check.num_threads)->value_name("N")->default_value(0),
      "number of threads, 0 = all");
  po::options_description visible;
  visible.add(general).add(describeRecording(dataset_options));
  std::string scan;
  const auto values = parseScanArguments(argc, argv, visible, 1, scan, printHelp);
  if (!values)
    return 0;
  if (scan.empty())
    throw UsageError("no SCAN given");
  applyRecording(*values, dataset_options);
  std::string error;
  if (!check.isValid(&error))
    throw UsageError(error);
  const RGBDDataset::Ptr dataset = openRecording(scan, dataset_options);
  const std::vector<Finding> findings = checkRecording(*dataset, check);
  for (const Finding& finding : findings)
    std::cout << toString(finding) << "\n";
  return verdictOf(findings) == Verdict::DOUBTFUL ? 3 : 0;
}

} // namespace

int
main(int argc, char** argv)
{
  return runProgram("bundle_icp_check", run, argc, argv);
}
