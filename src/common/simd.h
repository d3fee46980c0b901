// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

/** Marks a function with hot loops: compiled for several instruction sets, chosen when
 * the library is loaded. Off under sanitizers, which are not ready when that choice
 * runs. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) &&                 \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BUNDLE_ICP_SIMD                                                                \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
// Vectors are passed between inlined functions only, where the ABI does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"
#else
#define BUNDLE_ICP_SIMD
#endif

/** What such a function calls must become part of it. */
#define BUNDLE_ICP_INLINE inline __attribute__((always_inline))
