// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/exceptions.h>

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

namespace bundle_icp {

/** A readable image of the wrong kind: likely all images of the recording have the same fault. */
class UnsuitableImage : public IOException {
public:
  using PlainException::PlainException;
};

/** Reads a colour image: CV_8UC3 BGR, as stored (no rotation by EXIF: depth knows
 * none). \throws pcl::IOException naming file and reason: missing, empty, truncated, no
 * image; UnsuitableImage for 16 bits a channel. */
cv::Mat
readColorImage(const std::string& path);

/** The same from the bytes of a file.
 *  \param path names the image in messages */
cv::Mat
decodeColorImage(std::string_view bytes, const std::string& path);

/** Reads a depth image: CV_16UC1, or CV_32FC1 [m], as stored.
 *  \throws pcl::IOException as readColorImage(); UnsuitableImage for 8 bits or a colour
 * image. */
cv::Mat
readDepthImage(const std::string& path);

/** Reads an image of any kind as stored.
 *  \throws pcl::IOException as readColorImage(). */
cv::Mat
readAnyImage(const std::string& path);

/** Metres from the units of a depth image, of 16 bits or of floats: CV_32FC1, NaN where there is no
 * measurement, which sensors write as 0, as the largest number of 16 bits, or as NaN. */
cv::Mat
depthInMetres(const cv::Mat& depth, double units_per_metre);

} // namespace bundle_icp
