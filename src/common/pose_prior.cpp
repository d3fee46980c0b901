// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/pose_prior.h>

#include <cmath>

namespace bundle_icp {

bool
PosePrior::isValid(std::string* error) const
{
  std::string reason;
  if (!isRigid(world_from_camera.matrix()))
    reason = "a prior pose must be a rigid motion";
  else if (!(std::isfinite(position_sigma) && position_sigma > 0))
    reason = "the position sigma of a prior pose must be finite and > 0";
  else if (!(std::isfinite(rotation_sigma) && rotation_sigma > 0))
    reason = "the rotation sigma of a prior pose must be finite and > 0";
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

} // namespace bundle_icp
