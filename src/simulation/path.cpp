// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/path.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace bundle_icp {
namespace simulation {
namespace {

constexpr double PI = 3.14159265358979323846;

/** 0 to 1 with two continuous derivatives. */
double
smoothStep(double x)
{
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

/** Angle by which the camera is turned away from the table [rad]: 0 for 55 s, then, over 12 s,
 *  outwards; after one tour along the walls back again. */
double
turnAt(double t)
{
  const double cycle = 180, rounds = std::floor(t / cycle), within = t - rounds * cycle;
  return PI * (2 * rounds + smoothStep((within - 55) / 12) + smoothStep((within - 168) / 12));
}

/** world_from_camera rotation: z along the gaze, x to the right, then rolled about the
 * gaze. */
Eigen::Matrix3d
lookAlong(double yaw, double pitch, double roll)
{
  const Eigen::Vector3d gaze(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                             std::sin(pitch));
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0);
  Eigen::Matrix3d rotation;
  rotation << right, gaze.cross(right), gaze;
  return rotation * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());
}

} // namespace

HandHeldPath::HandHeldPath(std::uint64_t seed, double start_time, double movement)
: start_time_(start_time), movement_(movement)
{
  // The engine's own bits: distributions of the standard library differ between
  // compilers.
  std::mt19937_64 engine(seed ^ 0x9a7e5u);
  const auto angle = [&engine] { return 2 * PI * double(engine() >> 11) / 9007199254740992.0; };
  for (double& phase : phases_)
    phase = angle();
  start_angle_ = angle();
}

double
HandHeldPath::wave(int number, double amplitude, double period, double t) const
{
  return amplitude * std::sin(2 * PI * t / period + phases_[number]);
}

Eigen::Vector3d
HandHeldPath::position(double t) const
{
  const double angle = start_angle_ + 0.06 * t + wave(0, 0.17, 6.7, t);
  const double radius = 1.22 + wave(1, 0.17, 9.1, t) + wave(2, 0.06, 3.3, t);
  const Eigen::Vector3d tremor(wave(3, 0.003, 0.71, t), wave(4, 0.003, 0.83, t),
                               wave(5, 0.003, 0.61, t));
  // The room is longer than it is wide.
  return Eigen::Vector3d(radius * std::cos(angle), 1.2 * radius * std::sin(angle),
                         1.38 + wave(6, 0.16, 7.9, t) + wave(7, 0.05, 2.9, t)) +
         tremor;
}

Pose
HandHeldPath::at(double time) const
{
  const double t = start_time_ + time;
  const Eigen::Vector3d start = position(start_time_);
  const Eigen::Vector3d from = start + movement_ * (position(t) - start);
  const Eigen::Vector3d target(wave(8, 0.27, 8.3, t), wave(9, 0.22, 9.7, t),
                               0.75 + wave(10, 0.15, 5.3, t));
  const Eigen::Vector3d gaze = target - from;
  const double turn = turnAt(t), outwards = 0.5 - 0.5 * std::cos(turn);
  const double yaw = std::atan2(gaze.y(), gaze.x()) + turn + outwards * wave(11, 0.25, 9.7, t) +
                     wave(12, 0.006, 0.59, t);
  const double inward_pitch = std::atan2(gaze.z(), gaze.head<2>().norm());
  const double outward_pitch = -0.08 + wave(13, 0.38, 17.3, t);
  const double pitch =
      (1 - outwards) * inward_pitch + outwards * outward_pitch + wave(14, 0.006, 0.67, t);
  Pose pose = Pose::Identity();
  pose.linear() = lookAlong(yaw, pitch, wave(15, 0.07, 6.1, t));
  pose.translation() = from;
  return pose;
}

} // namespace simulation
} // namespace bundle_icp
