// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace bundle_icp::test {

/** Ascending differences where both depths are measured. */
inline std::vector<float>
absoluteErrors(const cv::Mat& depth, const cv::Mat& truth)
{
  std::vector<float> errors;
  for (int i = 0; i < int(truth.total()); ++i) {
    const float z = depth.ptr<float>()[i], exact = truth.ptr<float>()[i];
    if (z > 0 && exact > 0)
      errors.push_back(std::abs(z - exact));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

} // namespace bundle_icp::test
