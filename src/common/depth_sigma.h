// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/simd.h"

#include <bundle_icp/common/depth_noise.h>

namespace bundle_icp {

/** A multiple of DepthNoise::sigma() for kernels: single precision, for one depth or a vector of
 *  depths. */
struct DepthSigma {
  float constant = 0, quadratic = 0, offset = 0;

  DepthSigma() = default;
  explicit DepthSigma(const DepthNoise& noise, double factor = 1)
  : constant(float(factor * noise.constant)), quadratic(float(factor * noise.quadratic)),
    offset(float(noise.offset))
  {
  }

  template <typename Real>
  BUNDLE_ICP_INLINE Real
  operator()(Real z) const
  {
    const Real d = z - offset;
    return constant + quadratic * d * d;
  }
};

} // namespace bundle_icp
