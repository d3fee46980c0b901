// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Frames of one's own, as a camera's driver gives them.
#include <bundle_icp/io/memory_dataset.h>
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <exception>
#include <iostream>

int
main()
{
  try {
    const bundle_icp::SyntheticScan driver; // stands for a camera
    bundle_icp::MemoryDataset frames(driver.camera());
    for (std::size_t i = 0; i < 10; ++i)
      frames.add(driver.read(i)); // colour CV_8UC3; depth CV_32FC1 in metres; time stamp
    std::cout << bundle_icp::reconstruct(frames).summary() << '\n';
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
