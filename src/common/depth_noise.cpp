// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/depth_noise.h>

#include <cmath>

namespace bundle_icp {

bool
DepthNoise::isValid(std::string* error) const
{
  if (std::isfinite(constant) && constant > 0 && std::isfinite(quadratic) &&
      quadratic >= 0 && std::isfinite(offset))
    return true;
  if (error)
    *error = "depth noise needs a finite constant > 0 m and a finite quadratic term >= 0";
  return false;
}

} // namespace bundle_icp
