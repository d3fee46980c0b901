// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// The whole method in your own program: a recording in, poses and mesh out.
//
//   bundle_icp_example_reconstruct_folder SCAN OUT
//
// Left out: options from the command line and progress (bundle_icp_reconstruct has
// both).
#include <bundle_icp/reconstruction.h>

#include <exception>
#include <iostream>

int
main(int argc, char** argv)
{
  if (argc != 3) {
    std::cerr << "Usage: " << argv[0] << " SCAN OUT\n";
    return 2;
  }
  try {
    const bundle_icp::RGBDDataset::Ptr dataset = bundle_icp::openDataset(argv[1]);
    bundle_icp::ReconstructionOptions options;
    options.volume.voxel_size = 0.01; // metres
    const bundle_icp::ReconstructionResult result = bundle_icp::reconstruct(*dataset, options);
    for (const bundle_icp::FrameReport& frame : result.frames)
      if (!frame.registered)
        std::cerr << frame.name << ": " << frame.reason << "\n";
    bundle_icp::writeReconstruction(argv[2], *dataset, options, result);
    return result.status == bundle_icp::ReconstructionStatus::COMPLETED ? 0 : 1;
  }
  catch (const std::exception& error) { // names the file or the option, and the reason
    std::cerr << error.what() << "\n";
    return 1;
  }
}
