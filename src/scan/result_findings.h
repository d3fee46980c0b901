// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/staying_pixels.h"

#include <bundle_icp/reconstruction.h>

namespace bundle_icp {

/** What moves with the camera, or before one that stands still, and is therefore left out or what
 *  is wanted. */
std::vector<Finding>
stayingFindings(const StayingPixels& staying, MovingPart moving);

/** What moves through the scene, which the surface leaves out. */
std::vector<Finding>
movingFindings(const std::vector<FrameReport>& frames);

/** That two things move before the camera, each as a whole, by the matches of pairs of images. */
std::vector<Finding>
twoMotionsFindings(const ImageGraph& graph);

/** That parts of the scan were joined by their shape, and what each joint rests on. */
std::vector<Finding>
jointFindings(const std::vector<ComponentJoint>& joints);

/** A time between colour and depth that no camera has: they were paired wrongly.
 *  \param has_times whether the stamps are times; if not, frames are the unit of time */
std::vector<Finding>
timeOffsetFindings(const ReconstructionResult& result, bool has_times);

/** That the camera hardly moves, from the final poses of the largest component; with a graph
 *  only. */
std::vector<Finding>
stillCameraFindings(const ReconstructionResult& result);

/** How far and how large the scene is: what shows a wrong unit at a glance. */
std::vector<Finding>
sceneFindings(const ReconstructionResult& result);

/** That many frames have no pose in the largest world. */
std::vector<Finding>
placementFindings(const ReconstructionResult& result);

/** That a method that tracks gave the poses, which nothing verifies. */
Finding
trackedFinding(ReconstructionMethod method);

/** That the caller stopped the run. */
Finding
stoppedFinding();

/** That frames with a pose could not be read again for the surface. */
std::vector<Finding>
unreadableFindings(const ReconstructionResult& result);

/** That the voxels of the surface take more than ReconstructionOptions::max_memory [bytes]. */
Finding
memoryFinding(std::size_t voxel_bytes, std::size_t max_memory);

/** Why there is no surface although one was asked for. */
Finding
emptySurface(const ReconstructionOptions& options, const ReconstructionResult& result);

} // namespace bundle_icp
