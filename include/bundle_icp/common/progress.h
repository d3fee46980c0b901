// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace bundle_icp {

/** How far a long call has come. */
struct Progress {
  std::string stage;     ///< what is being done, for example "features"
  std::size_t done = 0;  ///< steps done in this stage
  std::size_t total = 0; ///< steps of this stage, 0 when unknown
};

/** Called by the thread that made the call, never by several at once. Returning false asks
 *  the call to stop; it then returns what it has. May be empty. */
using ProgressCallback = std::function<bool(const Progress&)>;

} // namespace bundle_icp
