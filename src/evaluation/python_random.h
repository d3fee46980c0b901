// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace bundle_icp {

/** Draws the numbers of Python's random.Random(0), with which the TUM benchmark chooses
 * pairs. */
class PythonRandom {
public:
  PythonRandom();

  /** random.randrange(n), 0 < n < 2^32. */
  std::size_t
  below(std::size_t n);

  /** random.sample(range(n), k) for k > 5, k <= n. */
  std::vector<std::size_t>
  sample(std::size_t n, std::size_t k);

private:
  std::mt19937 engine_;
};

} // namespace bundle_icp
