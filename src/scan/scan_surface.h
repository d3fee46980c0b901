// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

namespace bundle_icp {

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
