// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/pose.h>

#include <string>

namespace bundle_icp {

/** A box in any orientation that limits a surface. */
struct BUNDLE_ICP_EXPORT OrientedBox {
  Pose world_from_box = Pose::Identity();         ///< centre and axes of the box
  Eigen::Vector3d size = Eigen::Vector3d::Ones(); ///< lengths of the edges [m]

  OrientedBox() = default;
  OrientedBox(const Pose& pose, const Eigen::Vector3d& edges) : world_from_box(pose), size(edges) {}
  /** Implicit: an axis-aligned box serves wherever an oriented box does. */
  OrientedBox(const Eigen::AlignedBox3d& box); // NOLINT(google-explicit-constructor)

  bool
  contains(const Eigen::Vector3d& point) const
  {
    return ((world_from_box.inverse() * point).array().abs() <= 0.5 * size.array()).all();
  }

  /** Smallest axis-aligned box of the world that contains the box. */
  Eigen::AlignedBox3d
  bounds() const;

  /** True when the axes of the box are those of the world. */
  bool
  isAligned() const
  {
    return world_from_box.linear().isIdentity(0);
  }

  /** True when the box is finite, its edges are longer than 0 and its pose is rigid. */
  bool
  isValid(std::string* error = nullptr) const;
};

} // namespace bundle_icp
