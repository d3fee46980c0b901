// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Joins finished results to one.
#include "reconstruct_run.h"

int
main(int argc, char** argv)
{
  const auto run = [](int count, char** values) {
    auto arguments = bundle_icp::parseMergeArguments(count, values);
    return arguments ? bundle_icp::runReconstruction(*arguments) : 0;
  };
  return bundle_icp::runProgram("bundle_icp_merge", run, argc, argv, bundle_icp::MEMORY_HINT);
}
