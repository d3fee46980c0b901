// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/evaluation/error_statistics.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bundle_icp {

ErrorStatistics
errorStatistics(std::vector<double> errors)
{
  ErrorStatistics result;
  result.count = errors.size();
  if (errors.empty())
    return result;
  std::sort(errors.begin(), errors.end());
  const double n = double(errors.size());
  result.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n;
  result.rmse =
      std::sqrt(std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0) / n);
  result.median = (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]) / 2;
  result.max = errors.back();
  return result;
}

} // namespace bundle_icp
