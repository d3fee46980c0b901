// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>

namespace bundle_icp {

/** Memory that new data can take now without that others suffer, as the system estimates it; in a
 *  container, within the container's limit [bytes]. */
std::size_t
freeMemory();

/** Gives freed memory back to the system: what was allocated by many threads, or in many small
 *  parts, lies in heaps where nothing else finds room. */
void
returnMemory();

} // namespace bundle_icp
