// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/finding.h>
#include <bundle_icp/graph/features.h>
#include <bundle_icp/io/rgbd_dataset.h>

#include <string>
#include <vector>

namespace bundle_icp {

/** How estimateIntrinsics() works. */
struct BUNDLE_ICP_EXPORT IntrinsicsEstimateOptions {
  /** Horizontal field of view that the estimate starts from, and that stands when the data do not
   *  determine the focal length [rad]: 60 degrees, the usual one of depth cameras. */
  double field_of_view = 1.0472;
  /** Smallest and largest focal length that is tried, over that of field_of_view: 98 to 40 degrees
   *  for 60. */
  double lowest = 0.5, highest = 1.6;
  /** Frames that are matched with each other, in runs of neighbours over the recording. */
  std::size_t num_frames = 48;
  FeatureOptions features;
  int num_threads = 0; ///< 0 = all; the result does not depend on it

  bool
  isValid(std::string* error = nullptr) const;
};

/** Result of estimateIntrinsics(). */
struct IntrinsicsEstimate {
  /** Square pixels, axis in the middle of the image, no distortion. */
  CameraIntrinsics camera;
  double deviation = 0;          ///< standard deviation of the focal length [px]; 0 = no estimate
  std::size_t num_pairs = 0;     ///< of frames that the focal length follows from
  bool is_determined = false;    ///< false: the camera is that of the field of view
  std::vector<Finding> findings; ///< what was estimated, and a warning when it was not
};

/** Estimates the focal length of a camera from its frames alone. With a wrong focal length the
 *  measured points of a frame are bent, and points of frames that look in different directions do
 *  not meet. A grid of focal lengths is tried on pairs of frames, and the best is refined. A camera
 *  that hardly turns does not determine the focal length: then the result says so.
 *  \param dataset whose images are not undistorted; of its camera() only size and depth_noise count
 *  \throws pcl::BadArgumentException for invalid options or a dataset without frames. */
BUNDLE_ICP_EXPORT IntrinsicsEstimate
estimateIntrinsics(const RGBDDataset& dataset, const IntrinsicsEstimateOptions& options = {});

/** Options with estimated intrinsics and what there is to say of them, for openDataset(): a
 *  recording that is opened several times is estimated once. Intrinsics of the recording and of
 *  `options` are ignored.
 *  \throws as openDataset() and estimateIntrinsics(). */
BUNDLE_ICP_EXPORT DatasetOptions
withEstimatedIntrinsics(const std::string& path, DatasetOptions options = {},
                        const IntrinsicsEstimateOptions& estimate_options = {});

/** Opens a recording with estimated intrinsics. Those of the recording are ignored;
 *  RGBDDataset::findings() say what was estimated.
 *  \throws as openDataset() and estimateIntrinsics(). */
BUNDLE_ICP_EXPORT RGBDDataset::Ptr
openWithEstimatedIntrinsics(const std::string& path, const DatasetOptions& options = {},
                            const IntrinsicsEstimateOptions& estimate_options = {});

} // namespace bundle_icp
