// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/written_files.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/atomic_file.h>

#include <boost/filesystem.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgcodecs.hpp>

#include <fstream>

namespace bundle_icp {

std::string
toText(double number, std::chars_format format, int precision)
{
  char text[64];
  return {text, std::to_chars(text, text + sizeof(text), number, format, precision).ptr};
}

std::string
withZeros(std::size_t number, std::size_t digits)
{
  const std::string text = std::to_string(number);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

std::string
toText(const cv::Mat_<double>& matrix, const char* separator)
{
  std::string text;
  for (int row = 0; row < matrix.rows; ++row)
    for (int column = 0; column < matrix.cols; ++column)
      text += toText(matrix(row, column), std::chars_format::general, 9) +
              (column + 1 < matrix.cols ? separator : "\n");
  return text;
}

cv::Mat_<double>
matrixOf(const CameraIntrinsics& camera)
{
  return (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
}

cv::Mat_<double>
matrixOf(const Pose& pose)
{
  cv::Mat_<double> matrix;
  cv::eigen2cv(Eigen::Matrix4d(pose.matrix()), matrix);
  return matrix;
}

void
writeBytes(const std::string& path, const void* bytes, std::size_t count)
{
  std::ofstream file(path, std::ios::binary);
  file.write(static_cast<const char*>(bytes), std::streamsize(count));
  file.close();
  if (!file)
    throw IOException("cannot write '" + path + "': disk full or not writable");
}

void
writeText(const std::string& path, const std::string& text)
{
  writeAtomically(path, [&text](const std::string& temporary) {
    writeBytes(temporary, text.data(), text.size());
  });
}

void
writeImage(const std::string& path, const cv::Mat& image)
{
  std::vector<uchar> bytes;
  // Level 1: the time goes into compression otherwise, for a few percent of space.
  cv::imencode(boost::filesystem::path(path).extension().string(), image, bytes,
               {cv::IMWRITE_PNG_COMPRESSION, 1, cv::IMWRITE_JPEG_QUALITY, 98});
  writeBytes(path, bytes.data(), bytes.size());
}

} // namespace bundle_icp
