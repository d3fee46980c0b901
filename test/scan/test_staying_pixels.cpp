// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/staying_pixels.h"

#include "noisy_scan.h"

#include <bundle_icp/simulation/synthetic_scan.h>

#include <gtest/gtest.h>

using namespace bundle_icp;

namespace {

SyntheticScanOptions
sharpScan(std::uint64_t seed)
{
  SyntheticScanOptions options = test::noisyScan(24);
  options.seed = seed;
  options.frame_rate = 4;
  options.blur_fraction = 0;
  return options;
}

} // namespace

TEST(FindStayingPixels, FindsTheGripperOnly)
{
  for (const std::uint64_t seed : {0u, 1u, 2u}) {
    SyntheticScanOptions options = sharpScan(seed);
    options.gripper = options.person = true;
    const SyntheticScan scan(options);
    const StayingPixels found = findStayingPixels(scan, 0);
    ASSERT_FALSE(found.camera_fixed.empty()) << seed;
    options = sharpScan(seed);
    options.gripper = true;
    options.noise_factor = options.quantisation = options.hole_fraction = 0;
    options.flying_pixels = false;
    const SyntheticScan exact(options);
    const cv::Mat gripper = exact.read(0).depth != exact.readExact(0).depth;
    const double both = cv::countNonZero(found.camera_fixed & gripper);
    EXPECT_GT(both, 0.95 * cv::countNonZero(gripper)) << seed;
    EXPECT_LT(cv::countNonZero(found.camera_fixed), 1.5 * cv::countNonZero(gripper)) << seed;
  }
}

TEST(FindStayingPixels, FindsNothingWhereNothingMovesWithTheCamera)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  for (const std::uint64_t seed : {0u, 1u, 2u, 3u})
    for (const double start : {0.0, 67.0}) {
      SyntheticScanOptions options = sharpScan(seed);
      options.start_time = start;
      options.person = seed % 2;
      EXPECT_TRUE(findStayingPixels(SyntheticScan(options), 0).camera_fixed.empty())
          << seed << " " << start;
    }
}

TEST(FindStayingPixels, ACameraThatStandsStillSeesABackground)
{
  SyntheticScanOptions options = sharpScan(0);
  options.frame_rate = 1000;
  const StayingPixels found = findStayingPixels(SyntheticScan(options), 0);
  EXPECT_TRUE(found.camera_fixed.empty());
  EXPECT_TRUE(found.cameraStandsStill());
}

TEST(FindStayingPixels, FewFramesShowNothing)
{
  SyntheticScanOptions options = sharpScan(0);
  options.gripper = true;
  options.num_frames = 4;
  EXPECT_TRUE(findStayingPixels(SyntheticScan(options), 0).camera_fixed.empty());
}
