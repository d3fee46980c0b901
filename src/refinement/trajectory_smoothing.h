// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <vector>

namespace bundle_icp {

/** A pose found on its own, at a time. */
struct PoseMeasurement {
  double time = 0; ///< [s], ascending
  Pose world_from_camera = Pose::Identity();
  /** Of increment(delta) about the camera: its rotation, and its position in the world.
   */
  Matrix6d covariance = Matrix6d::Identity();
};

/** How a hand moves the camera: white noise of acceleration, as spectral densities. */
struct MotionPrior {
  double rotation = 1;    ///< [rad^2/s^3]
  double translation = 1; ///< [m^2/s^3]
  /** Factor on the measurements' covariances, which know nothing of errors that
   * features share. */
  double noise = 1;
};

/** The prior under which the measurements are most likely. Where frames are so far
 * apart in time that motion cannot be foretold it is so weak that little follows from
 * it. */
MotionPrior
estimateMotionPrior(const std::vector<PoseMeasurement>& measurements);

/** The most likely poses, given the measurements and the prior: a Kalman filter over
 * pose and velocity, and the smoother of Rauch, Tung and Striebel back from its end
 * (AIAA Journal 3(8), 1965). Measurements that disagree with the others' motion count
 * less, by the Cauchy loss. */
std::vector<Pose>
smoothTrajectory(const std::vector<PoseMeasurement>& measurements, const MotionPrior& prior);

} // namespace bundle_icp
