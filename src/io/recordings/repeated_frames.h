// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

namespace bundle_icp {

/** Leaves out frames that repeat an image of the frame before, byte for byte: a frame that repeats
 *  both shows nothing new; one that repeats the colour image with new depth, or the reverse, pairs
 *  images of two moments. Frames stay where most would be left out: then nothing moves. What was
 *  found is said in either case. */
void
leaveOutRepeatedFrames(Recording& recording);

} // namespace bundle_icp
