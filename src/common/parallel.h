// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/progress.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <omp.h>
#include <vector>

namespace bundle_icp {

/** Number of threads for an option, where 0 means all. More than a machine can start would end the
 *  process; results are the same with any number. */
inline int
resolveThreads(int num_threads)
{
  constexpr int most = 256;
  return std::min(num_threads > 0 ? num_threads : omp_get_max_threads(), most);
}

/** Progress report of a parallel loop; only the calling thread calls `progress`. */
struct LoopProgress {
  const char* stage = "";
  ProgressCallback progress;
};

/** Calls body(0) ... body(count - 1), distributed over threads. The caller's body writes slot
 *  i only, which makes results independent of the number of threads. The first exception by index
 *  is rethrown after the loop. Returns false when the progress callback asked to stop: then some
 *  calls were left out. */
template <class Body>
bool
parallelFor(std::size_t count, int num_threads, const LoopProgress& report, const Body& body)
{
  std::vector<std::exception_ptr> errors(count);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
#pragma omp parallel for num_threads(resolveThreads(num_threads)) schedule(dynamic, 1)
  for (std::ptrdiff_t i = 0; i < std::ptrdiff_t(count); ++i) {
    if (stop)
      continue;
    try {
      body(std::size_t(i));
    }
    catch (...) {
      errors[i] = std::current_exception();
    }
    ++done;
    if (!report.progress || omp_get_thread_num() != 0 || errors[i])
      continue;
    try { // no exception may leave a parallel loop
      stop = !report.progress({report.stage, done, count});
    }
    catch (...) {
      errors[i] = std::current_exception();
      stop = true;
    }
  }
  for (const std::exception_ptr& error : errors)
    if (error)
      std::rethrow_exception(error);
  return !stop;
}

} // namespace bundle_icp
