// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bundle_icp/registration/impl/point_alignment.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace bundle_icp::test {

/** AlignmentProblem::nearest without a tree: compares all points, which is never wrong. */
inline std::function<void(const float*, int, std::vector<int>&)>
nearestByComparison(const PointsView& target)
{
  return [target](const float* xyz, int k, std::vector<int>& indices) {
    const Eigen::Map<const Eigen::Vector3f> query(xyz);
    const auto squared = [&](int i) {
      const float* p = target.xyz + std::size_t(i) * target.stride;
      return (Eigen::Map<const Eigen::Vector3f>(p) - query).squaredNorm();
    };
    indices.resize(target.size);
    std::iota(indices.begin(), indices.end(), 0);
    const auto count = std::min(target.size, std::size_t(k));
    std::partial_sort(indices.begin(), indices.begin() + std::ptrdiff_t(count), indices.end(),
                      [&](int a, int b) { return squared(a) < squared(b); });
    indices.resize(count);
  };
}

} // namespace bundle_icp::test
