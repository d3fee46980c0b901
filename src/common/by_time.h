// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace bundle_icp {

/** Indices of frames in the order of their time stamps; of equal stamps in the order in which they
 *  are given.
 *  \tparam Stamped has timestamp(index), as ImageGraph and RGBDDataset */
template <class Stamped>
std::vector<std::size_t>
byTime(const Stamped& stamped, std::vector<std::size_t> frames)
{
  std::stable_sort(frames.begin(), frames.end(), [&stamped](std::size_t a, std::size_t b) {
    return stamped.timestamp(a) < stamped.timestamp(b);
  });
  return frames;
}

/** The same of all frames. */
template <class Stamped>
std::vector<std::size_t>
byTime(const Stamped& stamped)
{
  std::vector<std::size_t> frames(stamped.size());
  std::iota(frames.begin(), frames.end(), std::size_t(0));
  return byTime(stamped, std::move(frames));
}

} // namespace bundle_icp
