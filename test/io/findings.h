// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/io/rgbd_dataset.h>

#include "recordings.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace bundle_icp::test {

/** The finding of this kind with the highest severity. */
inline Finding
worst(const RGBDDataset& dataset, const std::string& kind)
{
  Finding result;
  for (const Finding& finding : dataset.findings())
    if (finding.kind == kind && (result.what.empty() || finding.severity > result.severity))
      result = finding;
  EXPECT_FALSE(result.what.empty()) << "no finding of kind " << kind;
  return result;
}

class Findings : public ::testing::Test {
protected:
  /** A TUM folder of so many frames 100 ms apart, depth 4 ms later, with these stamps. */
  void
  writeLists(int num_frames, const std::function<std::string(double)>& stamp)
  {
    recordings::writeTum(place, num_frames);
    std::string rgb, depth;
    for (int i = 0; i < num_frames; ++i) {
      const std::string name = "/" + std::to_string(i) + ".png\n";
      rgb += stamp(1305031100 + 0.1 * i) + " rgb" + name;
      depth += stamp(1305031100 + 0.1 * i + 0.004) + " depth" + name;
    }
    writeText(place + "/rgb.txt", rgb);
    writeText(place + "/depth.txt", depth);
  }

  /** Names each image of an Open3D folder anew. */
  void
  writeOpen3d(int num_frames, const std::function<std::string(int)>& color,
              const std::function<std::string(int)>& depth)
  {
    for (int i = 0; i < num_frames; ++i) {
      recordings::writeImage(place + "/color/" + color(i) + ".png", recordings::color(i));
      recordings::writeImage(place + "/depth/" + depth(i) + ".png",
                             recordings::depth(1000 + 100 * i));
    }
    writeText(place + "/intrinsic.json",
              R"({"intrinsic_matrix": [60, 0, 0, 0, 61, 0, 32, 24, 1]})");
  }

  void
  expectPairs(const RGBDDataset& dataset, std::size_t number)
  {
    ASSERT_EQ(dataset.size(), number);
    for (std::size_t i = 0; i < number; ++i)
      EXPECT_EQ(cv::norm(dataset.read(i).color,
                         recordings::color(
                             int(std::lround(10 * (dataset.read(i).depth.at<float>(0, 0) - 1)))),
                         cv::NORM_INF),
                0)
          << i;
  }

  TemporaryFolder folder;
  std::string place = folder.path("scan");
};

inline std::string
padded(long long number, int width)
{
  const std::string digits = std::to_string(number);
  return std::string(std::max(0, width - int(digits.size())), '0') + digits;
}

} // namespace bundle_icp::test
