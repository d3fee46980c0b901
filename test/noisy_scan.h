// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/simulation/synthetic_scan.h>

namespace bundle_icp::test {

/** A scan of 320x240 with all noise of a depth camera, 5 frames a second. */
inline SyntheticScanOptions
noisyScan(unsigned num_frames, double focal_length = 262)
{
  SyntheticScanOptions options = SyntheticScanOptions::fullNoise();
  options.num_frames = num_frames;
  options.frame_rate = 5;
  options.width = 320;
  options.height = 240;
  options.focal_length = focal_length;
  return options;
}

} // namespace bundle_icp::test
