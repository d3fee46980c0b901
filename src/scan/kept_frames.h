// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace bundle_icp {

/** What a driver makes metres of whole numbers with: the one or the other is 1. */
struct DepthUnit {
  float factor = 1, divisor = 1;
};

/** A depth image that was packed without loss. */
struct PackedDepth {
  std::optional<DepthUnit> unit; ///< of 16-bit numbers; unset: `bytes` holds floats
  std::vector<unsigned char> bytes;
};

/** Depth that came as whole numbers of a common unit is kept as such, other depth as it is. */
PackedDepth
packDepth(const cv::Mat& depth);

cv::Mat
unpackDepth(const PackedDepth& packed, const cv::Size& size);

/** The frames of a session as a dataset, packed without loss by a thread of its own. */
class KeptFrames : public RGBDDataset {
public:
  explicit KeptFrames(const CameraIntrinsics& camera);
  ~KeptFrames() override;
  KeptFrames(const KeptFrames&) = delete;
  KeptFrames&
  operator=(const KeptFrames&) = delete;

  /** Takes a frame whose images nobody changes any more; its stamp is later than those before. */
  void
  add(const RGBDFrame& frame);

  /** Memory that all frames take now. */
  std::size_t
  bytes() const;

  std::size_t
  size() const override;

  const CameraIntrinsics&
  camera() const override
  {
    return camera_;
  }

  std::size_t
  id(std::size_t index) const override
  {
    return index;
  }

  double
  timestamp(std::size_t index) const override;

  std::string
  name(std::size_t index) const override;

  RGBDFrame
  read(std::size_t index) const override;

private:
  struct Frame {
    double timestamp = 0;
    cv::Mat color, depth; ///< until they are packed
    std::vector<unsigned char> packed_color;
    PackedDepth packed_depth;
  };

  void
  run();
  bool
  packNext(std::unique_lock<std::mutex>& lock);

  const CameraIntrinsics camera_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Frame> frames_;
  std::size_t next_ = 0; ///< the first frame that nobody packs yet
  bool ends_ = false;
  std::thread thread_;
};

} // namespace bundle_icp
