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
using FrameConsumer = std::function<bool(std::size_t index, const RGBDFrame& frame,
                                         const std::string& error)>;

/** Hands over the frames one after the other; they are decoded ahead by several
 * threads. \return false when the consumer did. */
bool
readInOrder(const RGBDDataset& dataset, const std::vector<std::size_t>& indices,
            int num_threads, const FrameConsumer& consume);

} // namespace bundle_icp
