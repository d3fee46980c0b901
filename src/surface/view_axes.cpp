// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/view_axes.h"

#include <pcl/exceptions.h>

namespace bundle_icp {

Pose
meanView(const std::vector<Pose>& world_from_cameras)
{
  if (world_from_cameras.empty())
    throw pcl::BadArgumentException("preview: at least one camera pose is needed");
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), down = center, forward = center;
  for (const Pose& pose : world_from_cameras) {
    if (!pose.matrix().allFinite())
      throw pcl::BadArgumentException("preview: a camera pose is not finite");
    center += pose.translation();
    down += pose.linear().col(1);
    forward += pose.linear().col(2);
  }
  const double count = static_cast<double>(world_from_cameras.size());
  const Eigen::Matrix3d& first = world_from_cameras.front().linear();
  if (down.norm() < 0.1 * count)
    down = first.col(1);
  if (forward.norm() < 0.4 * count) // all around: from above
    forward = first.col(2) + down.normalized();

  Pose view = Pose::Identity();
  view.translation() = center / count;
  const Eigen::Vector3d z = forward.normalized();
  Eigen::Vector3d x = down.cross(z);
  if (x.norm() < 1e-6 * down.norm())
    x = z.unitOrthogonal();
  view.linear().col(0) = x.normalized();
  view.linear().col(1) = z.cross(x.normalized());
  view.linear().col(2) = z;
  return view;
}

} // namespace bundle_icp
