// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <functional>
#include <string>
#include <vector>

namespace bundle_icp {

/** Takes a frame; `error` says why it cannot be read, its images are empty then.
 * Returns false to stop. */
using FrameConsumer =
    std::function<bool(std::size_t index, const RGBDFrame& frame, const std::string& error)>;

/** Makes of a frame what its consumer wants; called by several threads. */
using FramePreparation = std::function<RGBDFrame(std::size_t index, const RGBDFrame& frame)>;

/** Hands over the frames one after the other; they are decoded and prepared ahead by
 * several threads. \return false when the consumer did. */
bool
readInOrder(const RGBDDataset& dataset, const std::vector<std::size_t>& indices, int num_threads,
            const FrameConsumer& consume, const FramePreparation& prepare = {});

} // namespace bundle_icp
