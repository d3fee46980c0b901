// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

namespace bundle_icp {

/** All frames of the largest component, in the order of their content, which a shuffled recording
 *  shares; those that were tracked in that of their tracking. Those of doubtful poses would blur
 *  the surface. They are left out where the others show the scene without them. */
std::vector<std::size_t>
framesToFuse(const ReconstructionResult& result);

/** A frame with corrected depth, and without that of what moves.
 *  \param moving by frame, a mask of what moves; empty = nothing. May hold none. */
RGBDFrame
frameToFuse(const RGBDDataset& dataset, const ReconstructionResult& result,
            const std::vector<cv::Mat>& moving, std::size_t index, const RGBDFrame& rgbd);

/** Finds the object that the scan is about, from the points of some of its frames with the poses
 *  that `result` holds, and leaves it in `result`.
 *  \param moving by frame, a mask of what moves; empty = nothing. May hold none.
 *  \return false when it was stopped. */
bool
findObject(const RGBDDataset& dataset, const ReconstructionOptions& options,
           const std::vector<cv::Mat>& moving, const ProgressCallback& progress,
           ReconstructionResult& result);

/** Equation (7): fuses the frames of the largest component with the poses that `result` holds, only
 *  in the object's box where there is one and without what moves, and leaves the mesh in `result`.
 *  \return false when it was stopped. */
bool
fuseSurface(const RGBDDataset& dataset, const ReconstructionOptions& options,
            const std::vector<cv::Mat>& moving, const ProgressCallback& progress,
            ReconstructionResult& result);

} // namespace bundle_icp
