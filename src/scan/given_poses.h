// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

namespace bundle_icp {

/** \throws pcl::BadArgumentException naming the poses when none fits a frame in time. */
void
checkTimes(const GivenPoses& poses, const RGBDDataset& dataset);

/** Gives each frame its pose, and the result a note that says so; frames without one get the
 *  reason. */
void
placeFrames(const GivenPoses& poses, ReconstructionResult& result);

} // namespace bundle_icp
