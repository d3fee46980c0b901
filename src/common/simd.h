// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

/** Marks a function with hot loops: compiled for several instruction sets, chosen when
 * the library is loaded. Off under sanitizers, which are not ready when that choice
 * runs. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) &&                 \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BUNDLE_ICP_SIMD __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define BUNDLE_ICP_SIMD
#endif
