// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <string>

namespace bundle_icp {

/** Standard deviation of a measured depth, growing with distance as equation (1) of the paper
 *  says it must for triangulating sensors: sigma(z) = constant + quadratic (z - offset)^2.
 *  The defaults are those of structured light (Nguyen, Izadi, Lovell, 3DIMPVT 2012). Every
 *  weight and every threshold on depth in the library follows from this one model. */
struct BUNDLE_ICP_EXPORT DepthNoise {
  double constant = 0.0012;  ///< [m]
  double quadratic = 0.0019; ///< [1/m]
  double offset = 0.4;       ///< distance of the smallest noise [m]

  /** Standard deviation [m] at depth z [m]. */
  double
  sigma(double z) const
  {
    const double d = z - offset;
    return constant + quadratic * d * d;
  }

  bool
  isValid(std::string* error = nullptr) const;
};

} // namespace bundle_icp
