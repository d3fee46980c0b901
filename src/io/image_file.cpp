// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/image_file.h"

#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

namespace bundle_icp {

namespace {

/** Largest encoded image [bytes], and most pixels of a camera of today. */
constexpr std::uint64_t LARGEST_IMAGE = 500'000'000;
constexpr std::size_t MOST_PIXELS = 150'000'000;

bool
startsWith(std::string_view bytes, std::string_view magic)
{
  return bytes.substr(0, magic.size()) == magic;
}

bool
isAfter(std::size_t position, std::size_t other)
{
  return position != std::string_view::npos &&
         (other == std::string_view::npos || position > other);
}

// OpenCV decodes a file that was cut off into a partly grey image without an error, so
// the end mark is looked for here. A JPEG's must follow its last start of scan: the end
// mark of an embedded thumbnail comes before. Anything may trail the end mark.
bool
isTruncated(std::string_view bytes)
{
  using namespace std::string_view_literals;
  if (startsWith(bytes, "\x89PNG\r\n\x1a\n"sv))
    return bytes.rfind("IEND\xae\x42\x60\x82"sv) == std::string_view::npos;
  if (startsWith(bytes, "\xff\xd8\xff"sv))
    return !isAfter(bytes.rfind("\xff\xd9"sv), bytes.rfind("\xff\xda"sv));
  return false;
}

/** An unsigned number of `size` bytes, the highest first. */
std::size_t
bigEndian(std::string_view bytes, std::size_t position, std::size_t size)
{
  std::size_t value = 0;
  for (std::size_t i = 0; i < size && position + i < bytes.size(); ++i)
    value = value << 8 | std::uint8_t(bytes[position + i]);
  return value;
}

/** Number of pixels that the header of a PNG or JPEG claims; 0 = not known. */
std::size_t
claimedPixels(std::string_view bytes)
{
  using namespace std::string_view_literals;
  if (startsWith(bytes, "\x89PNG\r\n\x1a\n"sv))
    return bigEndian(bytes, 16, 4) * bigEndian(bytes, 20, 4);
  if (!startsWith(bytes, "\xff\xd8\xff"sv))
    return 0;
  for (std::size_t i = 2; i + 9 < bytes.size() && bytes[i] == '\xff';
       i += 2 + bigEndian(bytes, i + 2, 2)) {
    const auto marker = std::uint8_t(bytes[i + 1]);
    const bool is_table = marker == 0xc4 || marker == 0xc8 || marker == 0xcc;
    if (marker >= 0xc0 && marker <= 0xcf && !is_table) // start of frame
      return bigEndian(bytes, i + 5, 2) * bigEndian(bytes, i + 7, 2);
  }
  return 0;
}

// OpenCV reads OpenEXR only where its environment says so, once for the process.
void
enableOpenExr()
{
  static const int done = setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 0);
  static_cast<void>(done);
}

cv::Mat
decodeImage(std::string_view bytes, const std::string& path, int flags)
{
  if (bytes.empty())
    throw IOException(path + ": the file is empty");
  if (isTruncated(bytes))
    throw IOException(path + ": the image is truncated");
  // Before memory is taken for them: a damaged header claims any number.
  if (const std::size_t pixels = claimedPixels(bytes); pixels > MOST_PIXELS)
    throw IOException(path + ": its header claims " + std::to_string(pixels / 1000000) +
                      " million pixels");
  if (startsWith(bytes, "\x76\x2f\x31\x01"))
    enableOpenExr();
  cv::Mat image;
  try {
    const cv::Mat buffer(1, int(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    image = cv::imdecode(buffer, flags);
  }
  catch (const cv::Exception&) {
    // The image stays empty: OpenCV's text names its own source lines, not the fault.
  }
  if (image.empty())
    throw IOException(path + ": cannot be decoded as an image (corrupt, or of another kind)");
  return image;
}

cv::Mat
readImage(const std::string& path, int flags)
{
  return decodeImage(readBytes(path, LARGEST_IMAGE), path, flags);
}

} // namespace

cv::Mat
readColorImage(const std::string& path)
{
  return decodeColorImage(readBytes(path, LARGEST_IMAGE), path);
}

cv::Mat
decodeColorImage(std::string_view bytes, const std::string& path)
{
  cv::Mat image = decodeImage(
      bytes, path, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  if (image.type() != CV_8UC3)
    throw UnsuitableImage(path + ": more than 8 bits a channel where a colour image is expected" +
                          " (is it a depth image?)");
  return image;
}

cv::Mat
readDepthImage(const std::string& path)
{
  cv::Mat image = readImage(path, cv::IMREAD_UNCHANGED);
  if (image.channels() != 1)
    throw UnsuitableImage(path + ": a colour image where depth is expected (" +
                          std::to_string(image.channels()) + " channels)");
  if (image.depth() == CV_8U)
    throw UnsuitableImage(path + ": 8-bit depth; depth must have 16 bits");
  if (image.depth() != CV_16U && image.depth() != CV_32F)
    throw UnsuitableImage(path + ": depth must be 16-bit unsigned integers, or floats in metres");
  return image;
}

cv::Mat
readAnyImage(const std::string& path)
{
  return readImage(path, cv::IMREAD_UNCHANGED);
}

cv::Mat
depthInMetres(const cv::Mat& depth, double units_per_metre)
{
  const float scale = float(units_per_metre);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cv::Mat metres(depth.size(), CV_32FC1);
  if (depth.type() == CV_32FC1) {
    std::transform(depth.begin<float>(), depth.end<float>(), metres.begin<float>(),
                   [&](float z) { return z > 0 && std::isfinite(z) ? z / scale : nan; });
    return metres;
  }
  for (int y = 0; y < depth.rows; ++y) {
    const std::uint16_t* const in = depth.ptr<std::uint16_t>(y);
    float* const out = metres.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x)
      out[x] = in[x] == 0 || in[x] == 65535 ? nan : float(in[x]) / scale;
  }
  return metres;
}

} // namespace bundle_icp
