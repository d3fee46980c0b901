// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <functional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Receives a frame. When the frame cannot be read, its images are empty and `error` gives the
 *  reason. Returns false to stop. */
using FrameConsumer =
    std::function<bool(std::size_t index, const RGBDFrame& frame, const std::string& error)>;

/** Prepares a frame for its consumer. Several threads call it at once. */
using FramePreparation = std::function<RGBDFrame(std::size_t index, const RGBDFrame& frame)>;

/** Gives the frames to `consume` one after the other. Several threads decode and prepare frames
 *  ahead. \return false when the consumer returned false. */
bool
readInOrder(const RGBDDataset& dataset, const std::vector<std::size_t>& indices, int num_threads,
            const FrameConsumer& consume, const FramePreparation& prepare = {});

} // namespace bundle_icp
