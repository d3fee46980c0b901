// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/left_out.h"
#include "scan/lone_depth.h"
#include "scan/read_frame.h"

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core.hpp>

#include <functional>
#include <utility>

namespace bundle_icp {

/** A dataset without what must not count: depth that no neighbour shares, and pixels under masks.
 *  They have no depth, and therefore no features. Refers to the dataset, which must outlive it. */
class FilteredDataset : public RGBDDataset {
public:
  explicit FilteredDataset(const RGBDDataset& dataset) : dataset_(dataset) {}

  /** \param mask gives that of a frame: CV_8UC1 of its size, or nothing; several threads call it
   *  at once. No other thread may read meanwhile. */
  void
  setMask(std::function<cv::Mat(const RGBDFrame&)> mask)
  {
    mask_ = std::move(mask);
  }

  const RGBDDataset&
  unfiltered() const
  {
    return dataset_;
  }

  std::size_t
  size() const override
  {
    return dataset_.size();
  }

  const CameraIntrinsics&
  camera() const override
  {
    return dataset_.camera();
  }

  std::size_t
  id(std::size_t index) const override
  {
    return dataset_.id(index);
  }

  double
  timestamp(std::size_t index) const override
  {
    return dataset_.timestamp(index);
  }

  std::string
  name(std::size_t index) const override
  {
    return dataset_.name(index);
  }

  std::string
  recording(std::size_t index) const override
  {
    return dataset_.recording(index);
  }

  RGBDFrame
  read(std::size_t index) const override
  {
    RGBDFrame frame = readFrame(dataset_, index);
    leaveOut(loneDepth(frame.depth), frame.depth);
    const cv::Mat mask = mask_ ? mask_(frame) : cv::Mat();
    if (!mask.empty())
      leaveOut(mask, frame.depth);
    return frame;
  }

  bool
  isOrdered() const override
  {
    return dataset_.isOrdered();
  }

  bool
  hasTimes() const override
  {
    return dataset_.hasTimes();
  }

  std::string
  format() const override
  {
    return dataset_.format();
  }

  Trajectory
  groundTruth() const override
  {
    return dataset_.groundTruth();
  }

  std::optional<PosePrior>
  prior(std::size_t index) const override
  {
    return dataset_.prior(index);
  }

  std::vector<SkippedFile>
  skipped() const override
  {
    return dataset_.skipped();
  }

  std::vector<Finding>
  findings() const override
  {
    return dataset_.findings();
  }

private:
  const RGBDDataset& dataset_;
  std::function<cv::Mat(const RGBDFrame&)> mask_;
};

} // namespace bundle_icp
