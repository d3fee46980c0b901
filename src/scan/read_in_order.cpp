// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/read_in_order.h"

#include "common/parallel.h"

#include <pcl/exceptions.h>

#include <algorithm>

namespace bundle_icp {
namespace {

/** Frames that are decoded at once, and held in memory. */
constexpr std::size_t DECODE_AHEAD = 8;

} // namespace

bool
readInOrder(const RGBDDataset& dataset, const std::vector<std::size_t>& indices, int num_threads,
            const FrameConsumer& consume, const FramePreparation& prepare)
{
  for (std::size_t begin = 0; begin < indices.size(); begin += DECODE_AHEAD) {
    const std::size_t count = std::min(DECODE_AHEAD, indices.size() - begin);
    std::vector<RGBDFrame> frames(count);
    std::vector<std::string> errors(count);
    parallelFor(count, num_threads, {}, [&](std::size_t k) {
      try {
        frames[k] = dataset.read(indices[begin + k]);
        if (prepare)
          frames[k] = prepare(indices[begin + k], frames[k]);
      }
      catch (const pcl::IOException& error) {
        errors[k] = error.what();
      }
    });
    for (std::size_t k = 0; k < count; ++k)
      if (!consume(indices[begin + k], frames[k], errors[k]))
        return false;
  }
  return true;
}

} // namespace bundle_icp
