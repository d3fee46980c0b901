// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace bundle_icp {

/** Progress of a long call. */
struct Progress {
  std::string stage;     ///< name of the stage, for example "features"
  std::size_t done = 0;  ///< steps done in this stage
  std::size_t total = 0; ///< steps of this stage, 0 when unknown
};

/** Callback in the thread of the long call, never in several threads at once. Returning false asks
 *  the call to stop; the call then returns what it has. The callback may be empty. */
using ProgressCallback = std::function<bool(const Progress&)>;

} // namespace bundle_icp
