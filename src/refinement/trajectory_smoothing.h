// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose_estimate.h>

#include <vector>

namespace bundle_icp {

/** The pose of one frame, found without the others. */
struct PoseMeasurement : PoseEstimate {
  double time = 0; ///< [s], ascending
};

/** Motion of a hand-held camera: white noise of acceleration, as spectral densities. */
struct MotionPrior {
  double rotation = 1;    ///< [rad^2/s^3]
  double translation = 1; ///< [m^2/s^3]
  /** Factor on the measurements' covariances, which ignore errors that features share. */
  double noise = 1;
};

/** The prior under which the measurements are most likely. Where frames are too far apart in time
 *  to predict motion, the prior is so weak that it hardly has an effect. */
MotionPrior
estimateMotionPrior(const std::vector<PoseMeasurement>& measurements);

/** The most likely poses, and their covariances, given the measurements and the prior: a Kalman
 *  filter over pose and velocity, and the smoother of Rauch, Tung and Striebel back from its end
 *  (AIAA Journal 3(8), 1965). Measurements that contradict the motion of the others count less, by
 *  the Cauchy loss. */
std::vector<PoseEstimate>
smoothTrajectory(const std::vector<PoseMeasurement>& measurements, const MotionPrior& prior);

} // namespace bundle_icp
