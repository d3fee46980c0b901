// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** How checkRecording() works. */
struct BUNDLE_ICP_EXPORT CheckOptions {
  /** Frames that are read, 2 to 1000; fewer where images have more than 640x480 pixels. */
  std::size_t num_frames = 24;
  int num_threads = 0; ///< 0 = all; the result does not depend on it

  bool
  isValid(std::string* error = nullptr) const;
};

/** What contradicts itself in a recording, from a fast look at a sample of its frames: depth of no
 *  room (kind `units`), a camera that is none (`intrinsics`), colour and depth that do not belong
 *  together (`color_and_depth`), dark, empty, blurred or repeated images (`frames`,
 *  `repeated_images`), gaps in time (`time_stamps`), numbers that are no depth (`depth_numbers`);
 *  and what a reconstruction will take (`resources`). RGBDDataset::findings() come first.
 *  \throws pcl::BadArgumentException for invalid options or a dataset without frames. */
BUNDLE_ICP_EXPORT std::vector<Finding>
checkRecording(const RGBDDataset& dataset, const CheckOptions& options = {});

} // namespace bundle_icp
