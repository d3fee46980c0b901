// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

namespace bundle_icp {

/** Reads a frame of any source: its faults become one kind of exception, and what it gives is what
 *  RGBDDataset::read() promises.
 *  \throws pcl::IOException naming the frame and the reason: whatever read() throws, memory that
 *  does not suffice, images of another size or type. */
RGBDFrame
readFrame(const RGBDDataset& dataset, std::size_t index);

} // namespace bundle_icp
