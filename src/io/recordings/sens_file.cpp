// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/sens_file.h"

#include "io/image_file.h"
#include "io/text_file.h"

#include <bundle_icp/common/exceptions.h>

#include <boost/filesystem.hpp>
#include <opencv2/imgproc.hpp>
#include <zlib.h>

#include <cmath>
#include <fstream>

namespace bundle_icp {

namespace {

constexpr std::uint32_t VERSION = 4;
constexpr std::size_t MAX_NAME = 4096;
constexpr std::uint32_t MAX_SIDE = 1 << 15; ///< of an image [px]
constexpr std::size_t MAX_DEFLATION = 1032; ///< what zlib reaches at most

enum ColorEncoding : std::int32_t { RAW_COLOR = 0, PNG = 1, JPEG = 2 };
enum DepthEncoding : std::int32_t { RAW_DEPTH = 0, ZLIB = 1 };

/** Reads a file whose sizes may be wrong. */
class Bytes {
public:
  explicit Bytes(const std::string& path)
  : path_(path), file_(openRegularFile(path)),
    left_(std::size_t(boost::filesystem::file_size(path)))
  {
  }

  std::size_t
  position()
  {
    return std::size_t(file_.tellg());
  }

  template <class Number>
  Number
  next()
  {
    Number number{};
    take(&number, sizeof(number));
    return number;
  }

  Eigen::Matrix4d
  nextMatrix()
  {
    Eigen::Matrix<float, 4, 4, Eigen::RowMajor> matrix;
    take(matrix.data(), sizeof(float) * 16);
    return matrix.cast<double>();
  }

  void
  skip(std::size_t count)
  {
    if (count > left_)
      throw IOException(path_ + ": the file is cut off");
    file_.seekg(std::streamoff(count), std::ios::cur);
    left_ -= count;
  }

  std::string
  bytes(std::size_t count)
  {
    std::string text(std::min(count, left_), '\0');
    take(text.data(), count);
    return text;
  }

private:
  void
  take(void* bytes, std::size_t count)
  {
    if (count > left_ || !file_.read(static_cast<char*>(bytes), std::streamsize(count)))
      throw IOException(path_ + ": the file is cut off");
    left_ -= count;
  }

  std::string path_;
  std::ifstream file_;
  std::size_t left_;
};

CameraIntrinsics
cameraOf(const Eigen::Matrix4d& matrix)
{
  CameraIntrinsics camera;
  camera.fx = matrix(0, 0);
  camera.fy = matrix(1, 1);
  camera.cx = matrix(0, 2);
  camera.cy = matrix(1, 2);
  return camera;
}

void
readSizes(Bytes& file, const std::string& path, SensHeader& header)
{
  for (CameraIntrinsics* const camera : {&header.color, &header.depth}) {
    const auto width = file.next<std::uint32_t>(), height = file.next<std::uint32_t>();
    if (width < 1 || width > MAX_SIDE || height < 1 || height > MAX_SIDE)
      throw IOException(path + ": images of an impossible size");
    camera->width = int(width);
    camera->height = int(height);
  }
}

SensHeader
readHeader(Bytes& file, const std::string& path)
{
  if (const auto version = file.next<std::uint32_t>(); version != VERSION)
    throw IOException(path + ": version " + std::to_string(version) +
                      " of the .sens format; only 4 is known");
  const auto name_size = file.next<std::uint64_t>();
  if (name_size > MAX_NAME)
    throw IOException(path + ": is no .sens file: the sensor's name is too long");
  file.skip(name_size);
  SensHeader header;
  header.color = cameraOf(file.nextMatrix());
  const Eigen::Matrix4d color_place = file.nextMatrix();
  header.depth = cameraOf(file.nextMatrix());
  // In all that ScanNet has published depth is in the place of colour. Which way its matrices map
  // is not documented.
  if (!file.nextMatrix().isApprox(color_place, 1e-6))
    throw IOException(path + ": depth is not registered to colour: their extrinsic matrices "
                             "differ");
  header.color_encoding = file.next<std::int32_t>();
  header.depth_encoding = file.next<std::int32_t>();
  if (header.color_encoding < RAW_COLOR || header.color_encoding > JPEG)
    throw IOException(path + ": unknown encoding of colour");
  if (header.depth_encoding != RAW_DEPTH && header.depth_encoding != ZLIB)
    throw IOException(path + ": unknown encoding of depth");
  readSizes(file, path, header);
  header.depth_scale = double(file.next<float>());
  if (!(header.depth_scale > 0 && std::isfinite(header.depth_scale)))
    throw IOException(path + ": impossible units of depth");
  header.num_frames = std::size_t(file.next<std::uint64_t>());
  return header;
}

SensFrame
readFrame(Bytes& file)
{
  SensFrame frame;
  frame.world_from_camera = file.nextMatrix();
  frame.stamp = double(file.next<std::uint64_t>());
  file.next<std::uint64_t>(); // the stamp of depth
  frame.color_size = std::size_t(file.next<std::uint64_t>());
  frame.depth_size = std::size_t(file.next<std::uint64_t>());
  frame.begin = file.position();
  file.skip(frame.color_size);
  file.skip(frame.depth_size);
  return frame;
}

cv::Mat
decodeColor(const std::string& bytes, const SensHeader& header, const std::string& name)
{
  if (header.color_encoding != RAW_COLOR)
    return decodeColorImage(bytes, name);
  const cv::Mat image(header.color.height, header.color.width, CV_8UC3,
                      const_cast<char*>(bytes.data()));
  if (bytes.size() != image.total() * image.elemSize())
    throw IOException(name + ": colour of another size than the header says");
  cv::Mat bgr;
  cv::cvtColor(image, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

cv::Mat
decodeDepth(const std::string& bytes, const SensHeader& header, const std::string& name)
{
  const std::size_t size = 2 * std::size_t(header.depth.width) * std::size_t(header.depth.height);
  const bool is_packed = header.depth_encoding == ZLIB;
  if (is_packed ? bytes.size() < size / MAX_DEFLATION : bytes.size() != size)
    throw IOException(name + ": depth of another size than the header says");
  cv::Mat image(header.depth.height, header.depth.width, CV_16UC1);
  if (!is_packed)
    std::copy(bytes.begin(), bytes.end(), image.data);
  else if (uLongf written = uLongf(size);
           uncompress(image.data, &written, reinterpret_cast<const Bytef*>(bytes.data()),
                      uLong(bytes.size())) != Z_OK ||
           written != size)
    throw IOException(name + ": the compressed depth is damaged");
  return image;
}

} // namespace

SensContent
readSensContent(const std::string& path)
{
  Bytes file(path);
  SensContent content;
  content.header = readHeader(file, path);
  try {
    while (content.frames.size() < content.header.num_frames)
      content.frames.push_back(readFrame(file));
  }
  catch (const pcl::IOException&) {
    // The frames before the one that is cut off are good.
    if (content.frames.empty())
      throw;
  }
  if (content.frames.empty())
    throw IOException(path + ": holds no frame");
  return content;
}

ImagePair
readSensImages(const std::string& path, const SensHeader& header, const SensFrame& frame,
               const std::string& name)
{
  Bytes file(path);
  file.skip(frame.begin);
  const std::string color = file.bytes(frame.color_size);
  return {decodeColor(color, header, name),
          decodeDepth(file.bytes(frame.depth_size), header, name)};
}

} // namespace bundle_icp
