// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/frame_cells.h"

namespace bundle_icp {

/** Finds a mark that stays in the image while the camera moves: text that a recorder writes into
 *  it, a logo, a scratch of the lens. At its pixels the gradient has the same direction in most
 *  frames, whatever lies behind the mark. Frames that show the same view count once: a camera that
 *  rests makes all pixels stay.
 *  \return CV_8UC1 of the size of the frames, not 0 where it is; empty when nothing is. */
cv::Mat
findImageMark(const std::vector<FrameCells>& frames, const CameraIntrinsics& camera);

} // namespace bundle_icp
