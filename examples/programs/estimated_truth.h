// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Shared by the programs that compare with the poses of a recording.
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <string>

namespace bundle_icp {

/** Who estimated the poses of a recording, in a sentence; empty where they are measured truth. */
inline std::string
estimatedTruth(const RGBDDataset& dataset)
{
  for (const Finding& finding : dataset.findings())
    if (finding.kind == "poses")
      return finding.what;
  return {};
}

} // namespace bundle_icp
