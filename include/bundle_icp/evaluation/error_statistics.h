// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <cstddef>
#include <vector>

namespace bundle_icp {

/** RMSE, mean, median and maximum of a set of errors, in the errors' own unit. */
struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
  std::size_t count = 0;
};

/** Statistics of errors (not negative, any order); of an even number the median is the
 * mean of the two in the middle. All 0 when there is none. */
BUNDLE_ICP_EXPORT ErrorStatistics
errorStatistics(std::vector<double> errors);

} // namespace bundle_icp
