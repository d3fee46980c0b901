// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/lone_depth.h"

#include "common/simd.h"

#include <cmath>

namespace bundle_icp {
namespace {

/** Depths that differ by more than this share of the smaller one are of different surfaces. */
constexpr float APART = 0.1f;
/** With fewer measured neighbours, of eight, nothing is said. */
constexpr float FEWEST_NEIGHBOURS = 4;

BUNDLE_ICP_INLINE void
findInRow(const float* above, const float* row, const float* below, int width, uchar* alone)
{
  for (int u = 1; u + 1 < width; ++u) {
    const float others[] = {above[u - 1], above[u],     above[u + 1], row[u - 1],
                            row[u + 1],   below[u - 1], below[u],     below[u + 1]};
    const float z = row[u];
    float measured = 0, same = 0;
    for (const float other : others) {
      const float nearer = other < z ? other : z;
      measured += other > 0 ? 1.0f : 0.0f;
      same += std::abs(other - z) <= APART * nearer ? 1.0f : 0.0f;
    }
    alone[u] = uchar(z > 0 && measured >= FEWEST_NEIGHBOURS && same == 0 ? 255 : 0);
  }
}

} // namespace

cv::Mat
loneDepth(const cv::Mat& depth)
{
  cv::Mat alone(depth.size(), CV_8UC1, cv::Scalar(0));
  for (int v = 1; v + 1 < depth.rows; ++v)
    simd::call<findInRow>(depth.ptr<float>(v - 1), depth.ptr<float>(v), depth.ptr<float>(v + 1),
                          depth.cols, alone.ptr<uchar>(v));
  return alone;
}

} // namespace bundle_icp
