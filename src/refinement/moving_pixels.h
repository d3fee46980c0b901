// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "refinement/verification.h"

#include <opencv2/core.hpp>

namespace bundle_icp {

/** What moves in a frame. */
struct MovingPixels {
  cv::Mat mask;     ///< CV_8UC1 of the size of the frame's view, not 0 = moves; empty: nothing does
  double share = 0; ///< of the pixels with depth
};

/** Finds in each frame the depth that lies in space which most of the frames that looked there saw
 *  to be free: a person who walks through. Only frames of good poses are compared, and one of which
 *  most would move keeps all of its depth.
 *  \param frames their verdicts, from verifyPoses()
 *  \return by frame of the graph */
std::vector<MovingPixels>
findMovingPixels(const ImageGraph& graph, const SparseModel& model,
                 const std::vector<VerifiedFrame>& frames,
                 const std::function<std::shared_ptr<const DepthView>(std::size_t)>& depth_views,
                 int num_threads);

} // namespace bundle_icp
