// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "io/recordings/association.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace bundle_icp {

std::vector<std::pair<std::size_t, std::size_t>>
associate(const std::vector<double>& first, const std::vector<double>& second,
          double max_difference)
{
  std::vector<std::size_t> order(second.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return second[a] < second[b]; });

  // Ties are broken as the script's sort of (difference, stamp, stamp) does.
  using Candidate = std::tuple<double, double, double, std::size_t, std::size_t>;
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const auto begin =
        std::lower_bound(order.begin(), order.end(), first[i] - max_difference,
                         [&](std::size_t j, double stamp) { return second[j] < stamp; });
    for (auto j = begin; j != order.end() && second[*j] <= first[i] + max_difference; ++j)
      if (const double difference = std::abs(first[i] - second[*j]); difference < max_difference)
        candidates.emplace_back(difference, first[i], second[*j], i, *j);
  }
  std::sort(candidates.begin(), candidates.end());

  std::vector<char> first_used(first.size()), second_used(second.size());
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [difference, stamp, other_stamp, i, j] : candidates)
    if (!first_used[i] && !second_used[j]) {
      first_used[i] = second_used[j] = 1;
      pairs.emplace_back(i, j);
    }
  std::sort(pairs.begin(), pairs.end(), [&](const auto& a, const auto& b) {
    return std::make_pair(first[a.first], a.first) < std::make_pair(first[b.first], b.first);
  });
  return pairs;
}

} // namespace bundle_icp
