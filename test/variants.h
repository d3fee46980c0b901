// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "common/simd.h"

#include <gtest/gtest.h>

#include <vector>

namespace bundle_icp::test {

/** Runs `check` with each SIMD variant that this machine has. */
template <typename Check>
void
forEachVariant(const Check& check)
{
  for (const simd::Variant variant :
       {simd::Variant::BASELINE, simd::Variant::AVX2, simd::Variant::AVX512})
    if (variant <= simd::bestVariant()) {
      SCOPED_TRACE("SIMD variant " + std::to_string(int(variant)));
      simd::setVariant(variant);
      check();
    }
  simd::setVariant(simd::bestVariant());
}

} // namespace bundle_icp::test
