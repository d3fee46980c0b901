// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <cstdint>

namespace bundle_icp {
namespace simulation {

/** The motion of a hand-held camera, without end: it goes to and fro around the table,
 * in turns looking at the things on it and outwards along the walls. Smooth (twice
 * differentiable). */
class HandHeldPath {
public:
  /** \param[in] start_time where on the endless path time 0 is [s]
   *  \param[in] movement share of the translation since then: 0 = turning on the spot */
  HandHeldPath(std::uint64_t seed, double start_time, double movement);

  /** world_from_camera, a time after the start [s]. */
  Pose
  at(double time) const;

private:
  /** amplitude * sin(2 pi t / period + phase of number `wave`). */
  double
  wave(int number, double amplitude, double period, double t) const;
  Eigen::Vector3d
  position(double t) const;

  static constexpr int num_waves = 16;
  double phases_[num_waves];
  double start_angle_;
  double start_time_, movement_;
};

} // namespace simulation
} // namespace bundle_icp
