// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/left_out.h"

#include <bundle_icp/io/rgbd_dataset.h>

#include <opencv2/core.hpp>

namespace bundle_icp {

/** A dataset that is seen through a mask: pixels under it have no depth. Refers to the dataset,
 *  which must outlive it. */
class MaskedDataset : public RGBDDataset {
public:
  explicit MaskedDataset(const RGBDDataset& dataset) : dataset_(dataset) {}

  /** \param mask CV_8UC1 of the size of the frames, or nothing. No other thread may read. */
  void
  setMask(const cv::Mat& mask)
  {
    mask_ = mask;
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

  RGBDFrame
  read(std::size_t index) const override
  {
    RGBDFrame frame = dataset_.read(index);
    if (!mask_.empty() && mask_.size() == frame.depth.size())
      leaveOut(mask_, frame.depth);
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
  cv::Mat mask_;
};

} // namespace bundle_icp
