// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "io/recordings/dataset_formats.h"

#include <opencv2/core/mat.hpp>

namespace bundle_icp {

/** Gives the frames their masks from the folder `mask/` or `masks/` of a recording, if there is
 *  one: by the names of the colour or the depth images, else by time, else by number. */
void
pairMasks(const std::string& folder, double max_time_difference, Recording& recording);

/** What of an image is left out: CV_8UC1, 255 where the mask is 0, and 0 elsewhere.
 *  \param size of the colour image
 *  \throws pcl::IOException naming the file; UnsuitableImage for another size or JPEG. */
cv::Mat
readMask(const std::string& file, const cv::Size& size);

/** Says how many of the frames have a mask, and how much masks leave out.
 *  \throws UnsuitableImage as readMask(). */
void
sayMasks(const cv::Size& size, Recording& recording);

} // namespace bundle_icp
