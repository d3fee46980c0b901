// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/oriented_box.h>

namespace bundle_icp {

OrientedBox::OrientedBox(const Eigen::AlignedBox3d& box) : size(box.max() - box.min())
{
  world_from_box.translation() = 0.5 * (box.min() + box.max());
}

Eigen::AlignedBox3d
OrientedBox::bounds() const
{
  const Eigen::Vector3d center = world_from_box.translation();
  const Eigen::Vector3d half = world_from_box.linear().cwiseAbs() * (0.5 * size);
  return {center - half, center + half};
}

bool
OrientedBox::isValid(std::string* error) const
{
  std::string reason;
  if (!isRigid(world_from_box.matrix()))
    reason = "world_from_box is not a rigid motion";
  else if (!(size.allFinite() && (size.array() > 0).all()))
    reason = "must be finite, with min < max along each axis";
  if (error && !reason.empty())
    *error = "region: " + reason;
  return reason.empty();
}

} // namespace bundle_icp
