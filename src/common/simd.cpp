// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/simd.h"

#include <algorithm>
#include <atomic>

namespace bundle_icp::simd {
namespace {

std::atomic<Variant>&
current()
{
  static std::atomic<Variant> variant{bestVariant()};
  return variant;
}

} // namespace

Variant
bestVariant()
{
#ifdef __x86_64__
  const auto all = [](auto... supported) { return (... && (supported != 0)); };
  if (all(__builtin_cpu_supports("avx2"), __builtin_cpu_supports("bmi"),
          __builtin_cpu_supports("bmi2")))
    return all(__builtin_cpu_supports("avx512f"), __builtin_cpu_supports("avx512bw"),
               __builtin_cpu_supports("avx512dq"), __builtin_cpu_supports("avx512vl"),
               __builtin_cpu_supports("avx512vnni"))
               ? Variant::AVX512
               : Variant::AVX2;
#endif
  return Variant::BASELINE;
}

Variant
variant()
{
  return current().load(std::memory_order_relaxed);
}

void
setVariant(Variant variant)
{
  current().store(std::min(variant, bestVariant()), std::memory_order_relaxed);
}

} // namespace bundle_icp::simd
