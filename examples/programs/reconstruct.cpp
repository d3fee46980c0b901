// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// From a recording to camera poses, a sparse model and a coloured mesh.
#include "reconstruct_run.h"

int
main(int argc, char** argv)
{
  const auto run = [](int count, char** values) {
    auto arguments = bundle_icp::parseReconstructArguments(count, values);
    return arguments ? bundle_icp::runReconstruction(*arguments) : 0;
  };
  return bundle_icp::runProgram("bundle_icp_reconstruct", run, argc, argv, bundle_icp::MEMORY_HINT);
}
