// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/mapping/incremental_mapper.h>

namespace bundle_icp {

bool
RefinementOptions::isValid(std::string* error) const
{
  return calibration_test.isValid(error) && calibration.isValid(error);
}

bool
MappingSchedule::isValid(std::string* error) const
{
  std::string reason;
  if (batch_size < 1)
    reason = "batch_size must be >= 1";
  else if (!(adjustment_growth > 1))
    reason = "adjustment_growth must be > 1";
  if (error && !reason.empty())
    *error = reason;
  return reason.empty();
}

bool
MapperOptions::isValid(std::string* error) const
{
  if (num_threads < 0) {
    if (error)
      *error = "num_threads must be >= 0";
    return false;
  }
  return registration.isValid(error) && tracks.isValid(error) && adjustment.isValid(error) &&
         refinement.isValid(error) && schedule.isValid(error);
}

} // namespace bundle_icp
