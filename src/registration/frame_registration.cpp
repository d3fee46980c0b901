// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/frame_registration.h>

namespace bundle_icp {

bool
FrameRegistrationOptions::isValid(std::string* error) const
{
  std::string reason;
  if (min_visual_inliers < 3)
    reason = "min_visual_inliers must be >= 3";
  else if (max_views < 1)
    reason = "max_views must be >= 1";
  else if (!(min_overlap > 0 && min_overlap <= 1))
    reason = "min_overlap must lie in (0, 1]";
  else if (!visual_start && method != FrameRegistrationMethod::BUNDLE_ICP)
    reason = "only the method BUNDLE_ICP can do without visual_start";
  else if (!(max_position_deviation > 0 && max_rotation_deviation > 0))
    reason = "max_position_deviation and max_rotation_deviation must be > 0";
  else if (!(shared_depth_sigmas > 0))
    reason = "shared_depth_sigmas must be > 0";
  else
    virtual_depth.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

} // namespace bundle_icp
