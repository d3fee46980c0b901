// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/sparse/incremental_mapper.h>

namespace bundle_icp {

bool
MapperOptions::isValid(std::string* error) const
{
  std::string reason;
  if (min_visual_inliers < 3)
    reason = "min_visual_inliers must be >= 3";
  else if (max_views < 1 || batch_size < 1)
    reason = "max_views and batch_size must be >= 1";
  else if (!(adjustment_growth > 1))
    reason = "adjustment_growth must be > 1";
  else if (!(min_overlap > 0 && min_overlap <= 1))
    reason = "min_overlap must lie in (0, 1]";
  else if (!visual_start && method != ImageRegistrationMethod::BUNDLE_ICP)
    reason = "only the method BUNDLE_ICP can do without visual_start";
  else if (!(max_position_deviation > 0 && max_rotation_deviation > 0))
    reason = "max_position_deviation and max_rotation_deviation must be > 0";
  else if (!(shared_depth_sigmas > 0))
    reason = "shared_depth_sigmas must be > 0";
  else if (num_threads < 0)
    reason = "num_threads must be >= 0";
  else
    tracks.isValid(&reason) && adjustment.isValid(&reason) && virtual_depth.isValid(&reason) &&
        calibration_test.isValid(&reason) && calibration.isValid(&reason);
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

} // namespace bundle_icp
