// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/kept_frames.h"

#include <opencv2/imgcodecs.hpp>

#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

/** Units of depth of the cameras and formats there are. */
constexpr DepthUnit DEPTH_UNITS[] = {{1, 1000},   {1, 5000},    {1, 10000},  {1, 4000},
                                     {0.001f, 1}, {0.0002f, 1}, {0.0001f, 1}};
/** So many frames may wait to be packed; then the one who adds frames helps. */
constexpr std::size_t MOST_WAITING = 90;

/** Depth as whole numbers of a unit, 0 = none; empty where that would lose something. */
cv::Mat
inUnits(const cv::Mat& depth, const DepthUnit& unit)
{
  cv::Mat units(depth.size(), CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) {
    const float* const z = depth.ptr<float>(v);
    auto* const out = units.ptr<std::uint16_t>(v);
    for (int u = 0; u < depth.cols; ++u) {
      if (std::isnan(z[u])) {
        out[u] = 0;
        continue;
      }
      const float count = std::nearbyint(z[u] * unit.divisor / unit.factor);
      if (!(count >= 1 && count <= 65535) || count * unit.factor / unit.divisor != z[u])
        return {};
      out[u] = std::uint16_t(count);
    }
  }
  return units;
}

/** Upper and lower halves of the numbers beside each other: the upper ones pack well. */
cv::Mat
inHalves(const cv::Mat& depth)
{
  cv::Mat halves(depth.rows, 2 * depth.cols, CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) {
    const auto* const bits = reinterpret_cast<const std::uint32_t*>(depth.ptr(v));
    auto* const out = halves.ptr<std::uint16_t>(v);
    for (int u = 0; u < depth.cols; ++u) {
      out[u] = std::uint16_t(bits[u] >> 16);
      out[depth.cols + u] = std::uint16_t(bits[u]);
    }
  }
  return halves;
}

std::vector<unsigned char>
encoded(const cv::Mat& image)
{
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  bytes.shrink_to_fit();
  return bytes;
}

} // namespace

PackedDepth
packDepth(const cv::Mat& depth)
{
  for (const DepthUnit& unit : DEPTH_UNITS)
    if (const cv::Mat units = inUnits(depth, unit); !units.empty())
      return {unit, encoded(units)};
  return {std::nullopt, encoded(inHalves(depth))};
}

cv::Mat
unpackDepth(const PackedDepth& packed, const cv::Size& size)
{
  const cv::Mat image = cv::imdecode(packed.bytes, cv::IMREAD_UNCHANGED);
  cv::Mat depth(size, CV_32FC1);
  for (int v = 0; v < size.height; ++v) {
    const auto* const in = image.ptr<std::uint16_t>(v);
    float* const z = depth.ptr<float>(v);
    auto* const bits = reinterpret_cast<std::uint32_t*>(depth.ptr(v));
    for (int u = 0; u < size.width; ++u)
      if (packed.unit)
        z[u] = in[u] ? float(in[u]) * packed.unit->factor / packed.unit->divisor
                     : std::numeric_limits<float>::quiet_NaN();
      else
        bits[u] = std::uint32_t(in[u]) << 16 | in[size.width + u];
  }
  return depth;
}

KeptFrames::KeptFrames(const CameraIntrinsics& camera) : camera_(camera), thread_([this] { run(); })
{
}

KeptFrames::~KeptFrames()
{
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void
KeptFrames::run()
{
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ends_) {
    changed_.wait(lock, [this] { return ends_ || next_ < frames_.size(); });
    while (!ends_ && packNext(lock)) {
    }
  }
}

/** Packs the first frame that nobody packs yet, with the lock open meanwhile. \return whether there
 *  was one */
bool
KeptFrames::packNext(std::unique_lock<std::mutex>& lock)
{
  if (next_ == frames_.size())
    return false;
  const std::size_t index = next_++;
  const cv::Mat color = frames_[index].color, depth = frames_[index].depth;
  lock.unlock();
  std::vector<unsigned char> packed_color = encoded(color);
  PackedDepth packed_depth = packDepth(depth);
  lock.lock();
  Frame& frame = frames_[index];
  frame.packed_color = std::move(packed_color);
  frame.packed_depth = std::move(packed_depth);
  frame.color.release();
  frame.depth.release();
  return true;
}

void
KeptFrames::add(const RGBDFrame& frame)
{
  std::unique_lock<std::mutex> lock(mutex_);
  frames_.push_back({frame.timestamp, frame.color, frame.depth, {}, {}});
  changed_.notify_all();
  while (frames_.size() - next_ > MOST_WAITING && packNext(lock)) {
  }
}

std::size_t
KeptFrames::bytes() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t sum = 0;
  for (const Frame& frame : frames_)
    sum += sizeof(Frame) + frame.packed_color.size() + frame.packed_depth.bytes.size() +
           frame.color.total() * frame.color.elemSize() +
           frame.depth.total() * frame.depth.elemSize();
  return sum;
}

std::size_t
KeptFrames::size() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return frames_.size();
}

double
KeptFrames::timestamp(std::size_t index) const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return frames_.at(index).timestamp;
}

std::string
KeptFrames::name(std::size_t index) const
{
  return "frame " + std::to_string(index);
}

RGBDFrame
KeptFrames::read(std::size_t index) const
{
  std::unique_lock<std::mutex> lock(mutex_);
  const Frame frame = frames_.at(index);
  lock.unlock();
  if (!frame.color.empty()) // clones: the thread still reads these
    return {index, frame.timestamp, frame.color.clone(), frame.depth.clone()};
  return {index, frame.timestamp, cv::imdecode(frame.packed_color, cv::IMREAD_COLOR),
          unpackDepth(frame.packed_depth, {camera_.width, camera_.height})};
}

} // namespace bundle_icp
