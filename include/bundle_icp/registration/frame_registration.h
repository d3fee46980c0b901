// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/model/sparse_model.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <functional>
#include <memory>
#include <string>

namespace bundle_icp {

/** What finds the pose of a new frame. */
enum class FrameRegistrationMethod {
  BUNDLE_ICP, ///< Algorithm 1 of the paper: visual pose, then ICP against the virtual depth
  VISUAL,     ///< lines 1 and 2 alone: 3D-3D distances of matched features
  PNP         ///< 2D-3D, as in structure from motion from colour alone
};

/** How a new frame is registered against a model. */
struct BUNDLE_ICP_EXPORT FrameRegistrationOptions {
  FrameRegistrationMethod method = FrameRegistrationMethod::BUNDLE_ICP;
  /** False: ICP starts from the pose of the neighbour that shares most matches (only with
   *  BUNDLE_ICP). Shows what the visual pose is worth. */
  bool visual_start = true;
  /** Visual correspondences that must support the pose of a new frame. */
  std::size_t min_visual_inliers = 12;
  VirtualDepthOptions virtual_depth;
  /** Registered neighbours that take part in a virtual depth map: the best covisible ones, so
   *  that the cost of a frame does not grow with the model. */
  std::size_t max_views = 6;
  /** Share of a frame's depth that must lie on the virtual depth when geometry alone
   *  registers the frame. */
  double min_overlap = 0.5;
  /** A frame whose position is known no better than this in some direction is not registered,
   *  standard deviation [m]. */
  double max_position_deviation = 0.03;
  /** The same of its rotation, about some axis [rad]. */
  double max_rotation_deviation = 0.03;
  /** All pixels of a depth image share an error, which does not average out over the image. The
   *  image's depth is known as a whole to so many sigma of DepthNoise, as a shift and as a tilt
   *  per unit of x / z. Limits the weight of dense evidence, unless self-calibration finds that
   *  the scan does not support such errors. */
  double shared_depth_sigmas = 2;

  bool
  isValid(std::string* error = nullptr) const;
};

/** What became of a frame. */
struct ImageRegistration {
  bool registered = false;
  std::string reason;      ///< why it is not registered
  std::size_t matches = 0; ///< visual correspondences to registered frames
  std::size_t inliers = 0; ///< those that agree with the pose
  /** Distance to the virtual depth [m]; 0 where the frame was not aligned, because alignment could
   *  not have improved the pose of a frame that is not a key frame. */
  double icp_rmse = 0;
  bool by_geometry = false; ///< without visual evidence
  /** Largest standard deviation in any direction when the frame was registered, given the model:
   *  of the camera's position [m], and of its rotation [rad]. */
  double position_deviation = 0;
  double rotation_deviation = 0;
};

/** Gives the prepared depth of a frame, corrected by the model's calibration and the frame's
 *  DepthError. Several threads call it. */
using DepthViewProvider =
    std::function<std::shared_ptr<const DepthView>(std::size_t image, const SparseModel& model)>;

} // namespace bundle_icp
