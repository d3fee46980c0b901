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
  explicit HandHeldPath(std::uint64_t seed);

  /** world_from_camera at time t [s]. */
  Pose
  at(double t) const;

private:
  /** amplitude * sin(2 pi t / period + phase of number `wave`). */
  double
  wave(int number, double amplitude, double period, double t) const;
  Eigen::Vector3d
  position(double t) const;

  static constexpr int num_waves = 16;
  double phases_[num_waves];
  double start_angle_;
};

} // namespace simulation
} // namespace bundle_icp
