// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** Depth images of floats hold metres, whatever the unit of the format is. */
void
useMetresOfFloats(Recording& recording);

} // namespace bundle_icp
