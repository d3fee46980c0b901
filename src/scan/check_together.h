// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/check_images.h"

#include <bundle_icp/common/finding.h>

#include <vector>

namespace bundle_icp {

/** Depth edges are edges in colour as well, of the same moment and the same view: says where they
 *  are not.
 *  \param interval from a frame to the next [s]; 0 = unknown */
void
checkTogether(const FrameSample& sample, double interval, int num_threads,
              std::vector<Finding>& findings);

} // namespace bundle_icp
