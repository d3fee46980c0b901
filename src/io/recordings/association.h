// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace bundle_icp {

/** Pairs (i, j) of two lists of time stamps [s], closer than `max_difference`, as the TUM
 *  benchmark's associate.py forms them: one to one, greedily, closest first. The pairs have the
 *  order of the first list's stamps. The lists may be in any order. */
std::vector<std::pair<std::size_t, std::size_t>>
associate(const std::vector<double>& first, const std::vector<double>& second,
          double max_difference);

} // namespace bundle_icp
