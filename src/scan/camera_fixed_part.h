// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/frame_cells.h"

namespace bundle_icp {

/** Finds what moves with a moving camera: regions of constant depth that end at an edge of depth
 *  which stays at its pixels. A plane along which the camera moves, such as the floor before a
 *  robot, has constant depth too, but no such edge. Where most pixels keep their depth, the camera
 *  stands still, and no part of it is found: the background is what most depth agrees on.
 *  \return CV_8UC1 of the size of the frames, not 0 where it is; empty when nothing is. */
cv::Mat
findCameraFixedPart(const std::vector<FrameCells>& frames, const CameraIntrinsics& camera);

} // namespace bundle_icp
