// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose_estimate.h>
#include <bundle_icp/model/sparse_model.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <functional>
#include <memory>
#include <string>

namespace bundle_icp {

/** Method that finds the pose of a new frame. */
enum class FrameRegistrationMethod {
  BUNDLE_ICP, ///< Algorithm 1 of the paper: visual pose, then ICP against the virtual depth
  VISUAL,     ///< lines 1 and 2 of Algorithm 1 alone: 3D-3D distances of matched features
  PNP         ///< 2D-3D matches, as in structure from motion from colour alone
};

/** How a new frame is registered against a model. */
struct BUNDLE_ICP_EXPORT FrameRegistrationOptions {
  FrameRegistrationMethod method = FrameRegistrationMethod::BUNDLE_ICP;
  /** False: ICP starts from the pose of the neighbour with the most matches, which shows what the
   *  visual pose is worth (only with BUNDLE_ICP). */
  bool visual_start = true;
  /** Minimum number of visual correspondences that support the pose of a new frame. */
  std::size_t min_visual_inliers = 12;
  VirtualDepthOptions virtual_depth;
  /** Maximum number of registered neighbours in a virtual depth map: those that see most of the
   *  same points. The limit keeps the cost of a frame constant as the model grows. */
  std::size_t max_views = 6;
  /** Share of a frame's depth that must lie on the virtual depth when the frame is registered by
   *  geometry alone. */
  double min_overlap = 0.5;
  /** Largest standard deviation of a frame's position in any direction [m]. A frame whose position
   *  is less certain is not registered. */
  double max_position_deviation = 0.03;
  /** Largest standard deviation of a frame's rotation about any axis [rad], likewise. */
  double max_rotation_deviation = 0.03;
  /** All pixels of a depth image share an error that does not average out over the frame. This is
   *  the standard deviation of the error in sigmas of DepthNoise, as a shift and as a tilt per unit
   *  of x / z. It limits the weight of dense evidence, unless self-calibration finds that the scan
   *  does not support such errors. */
  double shared_depth_sigmas = 2;

  bool
  isValid(std::string* error = nullptr) const;
};

/** Outcome of the registration of a frame: its pose and what supports it. */
struct FrameRegistration : PoseEstimate {
  bool registered = false;
  std::string reason;      ///< why the frame is not registered
  std::size_t matches = 0; ///< visual correspondences to registered frames
  std::size_t inliers = 0; ///< correspondences that agree with the pose
  /** RMS distance to the virtual depth [m]. 0 = the frame was not aligned: it is no key frame, and
   *  alignment could not have improved its pose. */
  double icp_rmse = 0;
  double overlap = 0;       ///< share of the frame's depth that lies on the virtual depth
  bool by_geometry = false; ///< registered without visual evidence
  /** Largest standard deviation in any direction, as `covariance` says: of the camera's position
   *  [m] and of its rotation [rad]. */
  double position_deviation = 0;
  double rotation_deviation = 0;
};

/** Gives the view of a frame: its depth prepared and corrected by the model's calibration and the
 *  frame's DepthError. Several threads call the function at once. */
using DepthViewProvider =
    std::function<std::shared_ptr<const DepthView>(std::size_t frame, const SparseModel& model)>;

} // namespace bundle_icp
