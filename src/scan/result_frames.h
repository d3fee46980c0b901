// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include "refinement/verification.h"

namespace bundle_icp {

/** Moves the world of each component to the camera of its earliest registered frame, however the
 *  run began. */
void
chooseWorld(ReconstructionResult& result);

/** Copies the pose of a node of the graph from the model into its frame's report. */
void
reportPose(std::size_t node, ReconstructionResult& result);

/** Takes the poses of refuted frames back.
 *  \param frames verification of each node of the graph */
void
leaveOutRefuted(const std::vector<VerifiedFrame>& frames, ReconstructionResult& result);

} // namespace bundle_icp
