// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// Command lines of bundle_icp_reconstruct and bundle_icp_merge.
#pragma once

#include "calibration_arguments.h"
#include "pose_arguments.h"

#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/reconstruction.h>

#include <optional>
#include <string>
#include <vector>

namespace bundle_icp {

struct ReconstructArguments {
  std::vector<std::string> scans;
  std::string output, method, matching, moving, solver, device = "auto", memory;
  DatasetOptions dataset;
  CalibrationArguments calibration;
  PoseArguments poses;
  ReconstructionOptions reconstruction;
  bool is_added = false, is_fresh = false, is_quiet = false, is_live = false;
};

/** Of bundle_icp_reconstruct. \return nothing when the user asked for help. */
std::optional<ReconstructArguments>
parseReconstructArguments(int argc, char** argv);

/** Of bundle_icp_merge: the recordings of the results, and what is known of them. \return nothing
 *  when the user asked for help. */
std::optional<ReconstructArguments>
parseMergeArguments(int argc, char** argv);

} // namespace bundle_icp
