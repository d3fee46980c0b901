// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

namespace bundle_icp {

/** Standard deviations of the error that the pixels of a frame share, by their mean depth [m]. */
struct SharedError {
  double shift; ///< [m]
  double tilt;  ///< [rad]

  SharedError(double mean_depth, const DepthNoise& noise, double sigmas)
  : shift(sigmas * noise.sigma(mean_depth)), tilt(shift / mean_depth)
  {
  }
};

/** Information on a pose from the depth of `num_frames` frames, given the information H that it
 *  held if errors of pixels were independent, and C, the covariance of the error that a frame's
 *  pixels share: (H^-1 + n C)^-1, written so that H may be singular. */
Matrix6d
withSharedError(const Matrix6d& independent, const DepthView& view, const DepthNoise& noise,
                double shared_sigmas, int num_frames);

} // namespace bundle_icp
