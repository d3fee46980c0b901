// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <memory>
#include <string>
#include <vector>

namespace bundle_icp {

class FrameResampler;

/** Several recordings as one: their frames one after the other. Stamps stay those of each
 *  recording. Images of other cameras are resampled to the camera of the first recording. */
class BUNDLE_ICP_EXPORT JoinedDataset : public RGBDDataset {
public:
  /** \param recordings at least one
   *  \throws pcl::BadArgumentException when the noise of their depth differs, there are none, or
   *  one of them is null or has no frames. */
  explicit JoinedDataset(std::vector<RGBDDataset::Ptr> recordings);

  std::size_t
  size() const override;

  const CameraIntrinsics&
  camera() const override;

  /** In the frame's own recording. */
  std::size_t
  id(std::size_t index) const override;

  double
  timestamp(std::size_t index) const override;

  std::string
  name(std::size_t index) const override;

  RGBDFrame
  read(std::size_t index) const override;

  std::string
  recording(std::size_t index) const override;

  /** True when each recording is, and no two of them overlap in time, unless all stamps are times
   *  since 1970 and none is there twice: parts of one recording. */
  bool
  isOrdered() const override;

  bool
  hasTimes() const override;

  /** Those of all recordings, separated by commas, each once. */
  std::string
  format() const override;

  /** Of one recording alone; empty else, as the worlds of recordings are not one. */
  Trajectory
  groundTruth() const override;

  /** Of one recording alone; unset else, as the worlds of priors are not one. */
  std::optional<PosePrior>
  prior(std::size_t index) const override;

  /** ownFindings() and those of the recordings, each once. */
  std::vector<Finding>
  findings() const override;

  /** What the recordings are when they are joined. */
  std::vector<Finding>
  ownFindings() const;

  std::vector<SkippedFile>
  skipped() const override;

  const std::vector<RGBDDataset::Ptr>&
  recordings() const
  {
    return recordings_;
  }

private:
  struct Place {
    std::size_t recording = 0, index = 0;
  };
  const RGBDDataset&
  at(std::size_t index) const
  {
    return *recordings_[places_[index].recording];
  }

  std::vector<RGBDDataset::Ptr> recordings_;
  std::vector<std::shared_ptr<const FrameResampler>> resamplers_; ///< null = as it is
  std::vector<Place> places_;
  bool are_ordered_ = true; ///< each by itself
  bool overlap_ = false;    ///< in time, although they are no parts of one
};

} // namespace bundle_icp
