// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "reconstruct_arguments.h"

namespace bundle_icp {

/** What to do about a lack of memory. */
constexpr const char* MEMORY_HINT =
    ": larger voxels (--voxel-size), a smaller --roi, fewer frames (--stride) or --no-mesh need "
    "less";

/** Reconstructs, writes and prints what the arguments ask for. \return exit code */
int
runReconstruction(ReconstructArguments& arguments);

} // namespace bundle_icp
