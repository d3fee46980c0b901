// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** Leaves out depth of the lowest confidence, 0, by the images of a folder that have the names of
 *  the depth images. Without such a folder nothing changes. */
void
useConfidence(const std::string& confidence_folder, Recording& recording);

} // namespace bundle_icp
