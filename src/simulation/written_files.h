// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <opencv2/core/mat.hpp>

#include <charconv>
#include <string>

namespace bundle_icp {

/** A number as text, independent of the locale. */
std::string
toText(double number, std::chars_format format, int precision);

/** A number with so many digits, filled up with zeros. */
std::string
withZeros(std::size_t number, std::size_t digits);

/** A row or a matrix of numbers, a line a row, with enough digits to read back a float. */
std::string
toText(const cv::Mat_<double>& matrix, const char* separator = " ");

/** The matrix fx 0 cx, 0 fy cy, 0 0 1. */
cv::Mat_<double>
matrixOf(const CameraIntrinsics& camera);

/** The matrix of 4x4. */
cv::Mat_<double>
matrixOf(const Pose& pose);

/** \throws pcl::IOException naming the file when it cannot be written. */
void
writeBytes(const std::string& path, const void* bytes, std::size_t count);

/** The file appears whole or not at all.
 *  \throws pcl::IOException as writeBytes(). */
void
writeText(const std::string& path, const std::string& text);

/** An image in the encoding that the extension of the name says.
 *  \throws pcl::IOException as writeBytes(). */
void
writeImage(const std::string& path, const cv::Mat& image);

} // namespace bundle_icp
