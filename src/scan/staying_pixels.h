// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core.hpp>

#include <optional>

namespace bundle_icp {

/** What moves with the camera: a gripper, a hand on the sensor, a part of its mount. */
struct CameraFixed {
  cv::Mat mask;     ///< CV_8UC1 of the size of the frames, not 0 where it is; empty when nothing is
  double share = 0; ///< of the measured pixels that stay at their depth, in all sampled frames
};

/** Finds pixels whose depth stays while the depth around them changes: regions of constant depth
 *  that end at an edge of depth which stays at its pixels. A plane along which the camera moves,
 *  such as the floor before a robot, has constant depth too, but no such edge. Where most pixels
 *  keep their depth, the camera stands still, and nothing is found: the background is what most
 *  depth agrees on. Looks at `num_samples` frames, evenly distributed. */
CameraFixed
findCameraFixed(const RGBDDataset& dataset, int num_threads, std::size_t num_samples = 24);

} // namespace bundle_icp
