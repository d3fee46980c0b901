// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "depth_view_store.h"

namespace bundle_icp {

DepthViewStore::DepthViewStore(const CameraIntrinsics& camera,
                               int reduction,
                               const VirtualDepthOptions& options)
: camera_(camera), reduction_(reduction), options_(options)
{
  options_.num_threads = 1; // many views are made at once
}

void
DepthViewStore::resize(std::size_t count)
{
  depths_.resize(count);
}

void
DepthViewStore::set(std::size_t index, const cv::Mat& depth)
{
  depths_[index] = makeDepthView(depth, camera_, reduction_, options_).depth;
}

std::shared_ptr<const DepthView>
DepthViewStore::get(std::size_t index)
{
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto found = views_.find(index); found != views_.end()) {
      recent_.splice(recent_.begin(), recent_, found->second.second);
      return found->second.first;
    }
  }
  const auto view = std::make_shared<const DepthView>(
      makeDepthView(depths_[index], camera_.reduced(reduction_), 1, options_));
  const std::lock_guard<std::mutex> lock(mutex_);
  if (views_.find(index) == views_.end()) {
    recent_.push_front(index);
    views_[index] = {view, recent_.begin()};
    if (views_.size() > CAPACITY) {
      views_.erase(recent_.back());
      recent_.pop_back();
    }
  }
  return view;
}

} // namespace bundle_icp
