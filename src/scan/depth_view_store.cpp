// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/depth_view_store.h"

#include "virtual_depth/reduce_depth.h"

#include <algorithm>

namespace bundle_icp {
namespace {

/** No reduced image has a side shorter than this [px]: things would fall through its pixels. */
constexpr int SMALLEST_SIDE = 120;

} // namespace

DepthViewStore::DepthViewStore(const CameraIntrinsics& camera, int reduction,
                               const VirtualDepthOptions& options)
: camera_(camera),
  reduction_(std::clamp(std::min(camera.width, camera.height) / SMALLEST_SIDE, 1, reduction)),
  options_(options)
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
  depths_[index] = reduceDepth(depth, camera_, reduction_, options_);
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
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto old = views_.find(index); old != views_.end()) {
    recent_.erase(old->second.recent);
    views_.erase(old);
  }
  recent_.push_front(index);
  views_[index] = {view, calibration.values, error, recent_.begin()};
  if (views_.size() > CAPACITY) {
    views_.erase(recent_.back());
    recent_.pop_back();
  }
  return view;
}

} // namespace bundle_icp
