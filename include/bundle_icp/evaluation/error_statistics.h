// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <cstddef>
#include <vector>

namespace bundle_icp {

/** RMSE, mean, median and maximum of a set of errors, in the unit of the errors. */
struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
  std::size_t count = 0;
};

/** Statistics of errors (not negative, any order). The median of an even number of errors is the
 *  mean of the middle two. All values are 0 when there are no errors. */
BUNDLE_ICP_EXPORT ErrorStatistics
errorStatistics(std::vector<double> errors);

} // namespace bundle_icp
