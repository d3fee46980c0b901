// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "noisy_scan.h"

#include <bundle_icp/simulation/synthetic_scan.h>

#include <functional>
#include <string>
#include <vector>

namespace bundle_icp::test {

inline SyntheticScanOptions
smallScan(std::uint64_t seed = 1)
{
  SyntheticScanOptions options = noisyScan(24);
  options.seed = seed;
  return options;
}

/** A scan whose frames and camera a test changes. */
class ChangedScan : public RGBDDataset {
public:
  ChangedScan() : changed_camera(scan.camera()) {}

  std::size_t
  size() const override
  {
    return scan.size();
  }
  const CameraIntrinsics&
  camera() const override
  {
    return changed_camera;
  }
  std::size_t
  id(std::size_t index) const override
  {
    return index;
  }
  double
  timestamp(std::size_t index) const override
  {
    return scan.timestamp(index);
  }
  std::string
  name(std::size_t index) const override
  {
    return scan.name(index);
  }
  RGBDFrame
  read(std::size_t index) const override
  {
    RGBDFrame frame = original(index);
    if (change)
      change(index, frame);
    return frame;
  }

  /** A copy of a frame that is rendered once for all tests. */
  RGBDFrame
  original(std::size_t index) const
  {
    static const std::vector<RGBDFrame> frames = [this] {
      std::vector<RGBDFrame> rendered;
      for (std::size_t i = 0; i < scan.size(); ++i)
        rendered.push_back(scan.read(i));
      return rendered;
    }();
    RGBDFrame frame = frames[index];
    frame.color = frame.color.clone();
    frame.depth = frame.depth.clone();
    return frame;
  }

  SyntheticScan scan{smallScan()};
  CameraIntrinsics changed_camera;
  std::function<void(std::size_t, RGBDFrame&)> change;
};

} // namespace bundle_icp::test
