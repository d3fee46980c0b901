// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "simulation/ray_packet.h"

#include <cmath>

namespace bundle_icp {
namespace simulation {
namespace {

using Lanes = cv::v_float32x4;

Lanes
all(float value)
{
  return cv::v_setall_f32(value);
}

const float infinity = std::numeric_limits<float>::infinity();

Lanes
squaredNorm2(const Lanes& x, const Lanes& y)
{
  return x * x + y * y;
}

Lanes
meetBox(const Primitive& box, const Eigen::Vector3f& origin, const Lanes* direction)
{
  Lanes enter = all(-infinity), leave = all(infinity);
  for (int axis = 0; axis < 3; ++axis) {
    // A component of zero would give 0 * infinity on the slab's border.
    const Lanes tiny = all(1e-20f);
    const Lanes safe =
        cv::v_select(cv::v_abs(direction[axis]) < tiny, tiny, direction[axis]);
    const Lanes inverse = all(1) / safe;
    const Lanes reach = cv::v_abs(inverse) * all(float(box.half[axis]));
    const Lanes middle = all(-origin[axis]) * inverse;
    enter = cv::v_max(enter, middle - reach);
    leave = cv::v_min(leave, middle + reach);
  }
  if (box.shape == Shape::ROOM)
    return leave;
  return cv::v_select((enter <= leave) & (enter > all(0)), enter, all(infinity));
}

Lanes
meetSphere(const Primitive& sphere, const Eigen::Vector3f& origin,
           const Lanes* direction)
{
  const Lanes zero = all(0), x = direction[0], y = direction[1], z = direction[2];
  const Lanes inverse = all(1) / (squaredNorm2(x, y) + z * z);
  const Lanes closest =
      zero -
      (all(origin.x()) * x + all(origin.y()) * y + all(origin.z()) * z) * inverse;
  const Lanes height = all(origin.z()) + closest * z;
  const Lanes room =
      all(float(sphere.half.x() * sphere.half.x())) -
      squaredNorm2(all(origin.x()) + closest * x, all(origin.y()) + closest * y) -
      height * height;
  const Lanes depth = closest - cv::v_sqrt(cv::v_max(room, zero) * inverse);
  return cv::v_select((room >= zero) & (depth > zero), depth, all(infinity));
}

Lanes
meetCylinder(const Primitive& cylinder, const Eigen::Vector3f& origin,
             const Lanes* direction)
{
  const Lanes zero = all(0), tiny = all(1e-20f), x = direction[0], y = direction[1];
  const Lanes z = cv::v_select(cv::v_abs(direction[2]) < tiny, tiny, direction[2]);
  const Lanes radius2 = all(float(cylinder.half.x() * cylinder.half.x()));
  const float half_height = float(cylinder.half.z());
  const Lanes inverse = all(1) / cv::v_max(squaredNorm2(x, y), tiny);
  const Lanes closest = zero - (all(origin.x()) * x + all(origin.y()) * y) * inverse;
  const Lanes room = radius2 - squaredNorm2(all(origin.x()) + closest * x,
                                            all(origin.y()) + closest * y);
  const Lanes side = closest - cv::v_sqrt(cv::v_max(room, zero) * inverse);
  const Lanes on_side = (room >= zero) & (side > zero) &
                        (cv::v_abs(all(origin.z()) + side * z) <= all(half_height));
  const Lanes depth = cv::v_select(on_side, side, all(infinity));
  if (std::abs(origin.z()) <= half_height)
    return depth;
  const Lanes end = all(std::copysign(half_height, origin.z()) - origin.z()) / z;
  const Lanes from_axis =
      squaredNorm2(all(origin.x()) + end * x, all(origin.y()) + end * y);
  return cv::v_select((end > zero) & (from_axis <= radius2), end, depth);
}

} // namespace

void
RayPacket::meet(const Primitive& primitive, int number, const Eigen::Vector3f& origin,
                const Eigen::Vector3f& direction, const Eigen::Vector3f& step)
{
  const Lanes count(0, 1, 2, 3);
  Lanes directions[3];
  for (int axis = 0; axis < 3; ++axis)
    directions[axis] = all(direction[axis]) + count * all(step[axis]);
  Lanes found;
  switch (primitive.shape) {
  case Shape::SPHERE:
    found = meetSphere(primitive, origin, directions);
    break;
  case Shape::CYLINDER:
    found = meetCylinder(primitive, origin, directions);
    break;
  default:
    found = meetBox(primitive, origin, directions);
  }
  const Lanes is_nearer = found < depth;
  depth = cv::v_min(depth, found);
  nearest = cv::v_select(cv::v_reinterpret_as_s32(is_nearer), cv::v_setall_s32(number),
                         nearest);
}

} // namespace simulation
} // namespace bundle_icp
