// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include <vector>

namespace bundle_icp {

/** The public function of this name, without what moves.
 *  \param moving by frame, a mask of what moves; empty = nothing. May hold none.
 *  \return false when it was stopped. */
bool
suggestViews(const RGBDDataset& dataset, const ReconstructionResult& result,
             const std::vector<cv::Mat>& moving, const NextViewOptions& options,
             const ProgressCallback& progress, std::vector<NextView>& views);

} // namespace bundle_icp
