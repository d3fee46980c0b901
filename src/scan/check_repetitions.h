// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/check_images.h"

#include <bundle_icp/common/finding.h>
#include <bundle_icp/io/rgbd_dataset.h>

#include <vector>

namespace bundle_icp {

/** Says whether neighbours repeat one of their images while the other one is new. */
void
checkRepetitions(const RGBDDataset& dataset, const FrameSample& sample, int num_threads,
                 std::vector<Finding>& findings);

} // namespace bundle_icp
