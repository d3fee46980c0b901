// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/reconstruction.h>

#include <cstddef>
#include <vector>

namespace bundle_icp {

/** For each component that is not connected with component 0, larger ones first, the frame of it
 *  and the frame of component 0 that are most like each other: those with the most matches; without
 *  matches those nearest in time, or where times tell nothing, those whose images are most like
 *  each other when small. Without pictures. */
std::vector<NextView>
bridgeComponents(const RGBDDataset& dataset, const ReconstructionResult& result,
                 std::size_t max_views, int num_threads);

/** The colour images of two frames beside each other, `width` px wide; grey where one cannot be
 *  read. */
cv::Mat
drawFrames(const RGBDDataset& dataset, std::size_t left, std::size_t right, int width);

} // namespace bundle_icp
