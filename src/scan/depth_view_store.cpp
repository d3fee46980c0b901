// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/depth_view_store.h"

#include "virtual_depth/reduce_depth.h"

#include <algorithm>

namespace bundle_icp {
namespace {

/** No reduced image has a side shorter than this [px]: things would fall through its pixels. */
constexpr int SMALLEST_SIDE = 120;
/** Views that are kept: with more, hardly any is made twice; with fewer, one frame's neighbours. */
constexpr std::size_t MOST_VIEWS = 96, FEWEST_VIEWS = 8;
/** The rest of the memory is that of reduced images. */
constexpr double SHARE_OF_VIEWS = 0.75;

std::size_t
viewBytes(const CameraIntrinsics& camera)
{
  constexpr std::size_t numbers = 1 + 3 + 1; // depth, normal, weight
  return numbers * sizeof(float) * std::size_t(camera.width) * std::size_t(camera.height);
}

std::size_t
numViews(std::size_t max_bytes, std::size_t view_bytes)
{
  return std::clamp(std::size_t(SHARE_OF_VIEWS * double(max_bytes)) / view_bytes, FEWEST_VIEWS,
                    MOST_VIEWS);
}

} // namespace

DepthViewStore::DepthViewStore(const CameraIntrinsics& camera, int reduction,
                               const VirtualDepthOptions& options, std::size_t max_bytes,
                               const std::string& folder)
: camera_(camera),
  reduction_(std::clamp(std::min(camera.width, camera.height) / SMALLEST_SIDE, 1, reduction)),
  options_(options), view_bytes_(viewBytes(camera.reduced(reduction_))),
  capacity_(numViews(max_bytes, view_bytes_)),
  store_(max_bytes - std::min(max_bytes, capacity_ * view_bytes_), folder)
{
  options_.num_threads = 1; // many views are made at once
}

void
DepthViewStore::resize(std::size_t count)
{
  depths_.resize(count);
}

void
DepthViewStore::clear()
{
  depths_ = {};
  views_.clear();
  recent_.clear();
}

void
DepthViewStore::set(std::size_t index, const cv::Mat& depth)
{
  depths_[index] = store_.keep(reduceDepth(depth, camera_, reduction_, options_));
}

std::size_t
DepthViewStore::bytesInMemory()
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return store_.bytesInMemory() + views_.size() * view_bytes_;
}

std::shared_ptr<const DepthView>
DepthViewStore::get(std::size_t index, const Calibration& calibration, const DepthError& error)
{
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = views_.find(index);
    if (found != views_.end() && found->second.calibration == calibration.values &&
        found->second.error == error) {
      recent_.splice(recent_.begin(), recent_, found->second.recent);
      return found->second.view;
    }
  }
  // Pixels of the reduced image are larger: lengths in pixels shrink.
  Calibration reduced = calibration;
  for (const auto parameter :
       {CalibrationParameter::CENTER_X, CalibrationParameter::CENTER_Y,
        CalibrationParameter::DEPTH_SHIFT_X, CalibrationParameter::DEPTH_SHIFT_Y})
    reduced[parameter] /= reduction_;
  const CameraIntrinsics camera = camera_.reduced(reduction_);
  const auto view = std::make_shared<const DepthView>(
      makeDepthView(correctedDepth(depths_[index], camera, reduced, error),
                    reduced.corrected(camera), 1, options_));
  releaseMemory(depths_[index]);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto old = views_.find(index); old != views_.end()) {
    recent_.erase(old->second.recent);
    views_.erase(old);
  }
  recent_.push_front(index);
  views_[index] = {view, calibration.values, error, recent_.begin()};
  if (views_.size() > capacity_) {
    views_.erase(recent_.back());
    recent_.pop_back();
  }
  return view;
}

} // namespace bundle_icp
