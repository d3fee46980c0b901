// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

#include <string>

namespace bundle_icp {

/** Gives frames the prior poses that the options ask for, and says what becomes of the poses that
 *  the recording's device estimated.
 *  \throws pcl::IOException naming the poses when there are none or none fits a frame in time. */
void
takePriors(const DatasetOptions& options, const std::string& folder, Recording& recording);

} // namespace bundle_icp
