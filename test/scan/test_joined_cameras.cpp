// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Recordings of two cameras as one scan.
#include "io/frame_resampler.h"
#include "scan/frames.h"

#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/io/joined_dataset.h>
#include <bundle_icp/io/memory_dataset.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** The path of room() by a camera with larger images and another focal length. */
const SyntheticScan&
otherCamera()
{
  static const SyntheticScan scan = [] {
    SyntheticScanOptions options;
    options.num_frames = room().size();
    options.width = 480;
    options.height = 352;
    options.focal_length = 360;
    return SyntheticScan(options);
  }();
  return scan;
}

/** Every eighth frame. */
RGBDDataset::Ptr
framesOf(const SyntheticScan& scan, std::size_t first)
{
  auto frames = std::make_shared<MemoryDataset>(scan.camera());
  for (std::size_t i = first; i < scan.size(); i += 8)
    frames->add(scan.read(i));
  return frames;
}

} // namespace

TEST(JoinedCameras, AFrameLooksAsTheOtherCameraWouldHaveTakenIt)
{
  const FrameResampler resample(otherCamera().camera(), room().camera());
  const RGBDFrame resampled = resample(otherCamera().read(12)), own = room().read(12);
  ASSERT_EQ(resampled.depth.size(), own.depth.size());
  ASSERT_EQ(resampled.color.size(), own.color.size());
  EXPECT_EQ(resampled.timestamp, own.timestamp);
  std::vector<float> differences;
  for (int v = 0; v < own.depth.rows; ++v)
    for (int u = 0; u < own.depth.cols; ++u)
      if (own.depth.at<float>(v, u) > 0 && resampled.depth.at<float>(v, u) > 0)
        differences.push_back(resampled.depth.at<float>(v, u) - own.depth.at<float>(v, u));
  ASSERT_GT(differences.size(), own.depth.total() / 2);
  std::nth_element(differences.begin(), differences.begin() + long(differences.size() / 2),
                   differences.end());
  EXPECT_NEAR(differences[differences.size() / 2], 0, 0.0005);
  // Of the texture, less of it when it is a pixel aside.
  const auto difference = [&](const cv::Rect& a, const cv::Rect& b) {
    return cv::norm(resampled.color(a), own.color(b), cv::NORM_L1) / double(a.area());
  };
  const cv::Rect inner(20, 20, 280, 200);
  const double here = difference(inner, inner);
  for (const cv::Point& aside : {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1)})
    EXPECT_LT(here, 0.8 * difference(inner, inner + aside));
}

TEST(JoinedCameras, OneScanOfBoth)
{
  const JoinedDataset joined({framesOf(room(), 0), framesOf(otherCamera(), 4)});
  ASSERT_EQ(joined.size(), 10u);
  ASSERT_EQ(joined.ownFindings().size(), 2u); // and their stamps overlap
  EXPECT_NE(joined.ownFindings().back().what.find("are of another camera than the first"),
            std::string::npos);
  const ReconstructionResult result = reconstruct(joined, withoutMesh());
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{10});
  const auto error = absoluteTrajectoryError(room().groundTruth(), result.trajectory());
  ASSERT_TRUE(error);
  EXPECT_LT(error->translation.max, 0.002);
}
