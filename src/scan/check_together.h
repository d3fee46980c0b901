// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/check_images.h"

#include <bundle_icp/common/finding.h>

#include <vector>

namespace bundle_icp {

/** The frames that were looked at, in runs of neighbours. */
struct Sample {
  std::vector<std::size_t> frames; ///< indices in the order of time
  std::vector<std::size_t> places; ///< their places in that order
  std::size_t step = 1;            ///< between the places of a run
  std::vector<FrameLook> looks;
  double pixels_per_edge_pixel = 1; ///< width of the images over that of the images of edges
};

/** Depth edges are edges in colour as well, of the same moment and the same view: says where they
 *  are not. */
void
checkTogether(const Sample& sample, int num_threads, std::vector<Finding>& findings);

} // namespace bundle_icp
