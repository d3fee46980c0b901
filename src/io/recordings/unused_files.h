// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** Images and recordings that lie in a folder, or up to two folders below, and belong to none of
 *  the frames: a note with their number and one of them; empty when there are none. */
std::vector<Finding>
unusedFiles(const Recording& recording, const std::string& folder);

} // namespace bundle_icp
