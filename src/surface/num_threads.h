// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <omp.h>

namespace bundle_icp {

/** Threads to use for an option where 0 means all. */
inline int
resolveNumThreads(int num_threads)
{
  return num_threads > 0 ? num_threads : omp_get_max_threads();
}

} // namespace bundle_icp
