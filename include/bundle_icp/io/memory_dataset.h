// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** Frames of one camera in memory, such as a driver gives them. toFrame() makes frames of PCL's
 *  organized clouds.
 *
 *  Colour and depth of a frame are registered to each other and undistorted; where they are not,
 *  write them as images and use openDataset(). */
class BUNDLE_ICP_EXPORT MemoryDataset : public RGBDDataset {
public:
  /** \param camera of all frames, without distortion
   *  \throws pcl::BadArgumentException when no camera can have these intrinsics, or when they have
   *  distortion. */
  explicit MemoryDataset(const CameraIntrinsics& camera);

  /** Appends a frame. Its number is that of the frames before it: RGBDFrame::id has no effect. The
   *  images are copied, since a driver may write its next frame over them.
   *  \throws pcl::BadArgumentException when the colour image is not CV_8UC3, the depth image not
   *  CV_32FC1, one of them has another size than the camera, or the time stamp is not finite. */
  void
  add(const RGBDFrame& frame);

  std::size_t
  size() const override;

  const CameraIntrinsics&
  camera() const override;

  std::size_t
  id(std::size_t index) const override;

  double
  timestamp(std::size_t index) const override;

  /** "frame" and its number. */
  std::string
  name(std::size_t index) const override;

  /** Its images are those of the dataset: clone them before changing them. */
  RGBDFrame
  read(std::size_t index) const override;

  /** True while each frame is later than the one before it. */
  bool
  isOrdered() const override;

private:
  CameraIntrinsics camera_;
  std::vector<RGBDFrame> frames_;
  bool is_ordered_ = true;
};

} // namespace bundle_icp
