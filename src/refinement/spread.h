// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace bundle_icp {

/** Median, and the standard deviation that the median distance from it says. */
struct Spread {
  double median = 0, deviation = 0;
};

inline double
medianOf(std::vector<double> values)
{
  if (values.empty())
    return 0;
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

inline Spread
spreadOf(const std::vector<double>& values)
{
  Spread spread{medianOf(values), 0};
  std::vector<double> distances;
  for (const double value : values)
    distances.push_back(std::abs(value - spread.median));
  constexpr double deviation_of_median = 1.4826; // of normal errors
  spread.deviation = deviation_of_median * medianOf(distances);
  return spread;
}

} // namespace bundle_icp
