// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <vector>

namespace bundle_icp {

/** A recording with motion blur in a share of its colour images: along a line of random
 *  direction, 2 to 6 % of the image's width long. A larger share contains the blurred images of
 *  a smaller share. */
class BlurredDataset : public RGBDDataset {
public:
  /** \param fraction share of blurred images, 0 to 1 */
  BlurredDataset(RGBDDataset::Ptr sharp, double fraction, std::uint64_t seed);

  std::size_t
  size() const override
  {
    return sharp_->size();
  }

  const CameraIntrinsics&
  camera() const override
  {
    return sharp_->camera();
  }

  std::size_t
  id(std::size_t index) const override
  {
    return sharp_->id(index);
  }

  double
  timestamp(std::size_t index) const override
  {
    return sharp_->timestamp(index);
  }

  std::string
  name(std::size_t index) const override
  {
    return sharp_->name(index);
  }

  bool
  isOrdered() const override
  {
    return sharp_->isOrdered();
  }

  bool
  hasTimes() const override
  {
    return sharp_->hasTimes();
  }

  RGBDFrame
  read(std::size_t index) const override;

  bool
  isBlurred(std::size_t index) const
  {
    return is_blurred_[index] != 0;
  }

private:
  RGBDDataset::Ptr sharp_;
  std::uint64_t seed_;
  std::vector<char> is_blurred_;
};

} // namespace bundle_icp
