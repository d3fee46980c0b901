// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/scan/estimate_intrinsics.h>

#include "messages.h"
#include "noisy_scan.h"
#include "temporary_folder.h"

#include <bundle_icp/simulation/synthetic_scan.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>

using namespace bundle_icp;

namespace {

/** A noisy scan in small images; the field of view of 60 degrees is that of 277 px. */
SyntheticScanOptions
scanOf(double focal_length)
{
  SyntheticScanOptions options = test::noisyScan(24, focal_length);
  options.frame_rate = 2;
  return options;
}

void
expectFound(double focal_length)
{
  const IntrinsicsEstimate estimate = estimateIntrinsics(SyntheticScan(scanOf(focal_length)));
  ASSERT_TRUE(estimate.is_determined) << estimate.findings[0].what;
  EXPECT_NEAR(estimate.camera.fx, focal_length, 0.02 * focal_length);
  EXPECT_LT(std::abs(estimate.camera.fx - focal_length), 4 * estimate.deviation);
  EXPECT_LT(estimate.deviation, 0.02 * focal_length);
  EXPECT_EQ(estimate.camera.fx, estimate.camera.fy);
  EXPECT_EQ(estimate.camera.cx, 159.5);
  EXPECT_EQ(estimate.camera.cy, 119.5);
  ASSERT_EQ(estimate.findings.size(), 1u);
  EXPECT_EQ(estimate.findings[0].severity,
            estimate.deviation < 0.01 * focal_length ? Severity::NOTE : Severity::WARNING);
  EXPECT_EQ(estimate.findings[0].kind, "estimated_intrinsics");
  EXPECT_CONTAINS(estimate.findings[0].what, "the focal length was estimated");
  EXPECT_EQ(estimate.findings[0].evidence[0].second, estimate.camera.fx);
}

} // namespace

TEST(EstimateIntrinsics, FindsAShortFocalLength)
{
  expectFound(215);
}

TEST(EstimateIntrinsics, FindsALongFocalLength)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  expectFound(350);
}

TEST(EstimateIntrinsics, DoesNotDependOnThreads)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  const SyntheticScan scan(scanOf(262));
  IntrinsicsEstimateOptions options;
  options.num_frames = 10;
  options.num_threads = 1;
  const IntrinsicsEstimate one = estimateIntrinsics(scan, options);
  options.num_threads = 2;
  EXPECT_EQ(one.camera.fx, estimateIntrinsics(scan, options).camera.fx);
}

TEST(EstimateIntrinsics, SaysWhenTheDataDoNotDetermineIt)
{
  IntrinsicsEstimateOptions options;
  options.num_frames = 3; // three pairs cannot contradict each other
  const IntrinsicsEstimate estimate = estimateIntrinsics(SyntheticScan(scanOf(262)), options);
  EXPECT_FALSE(estimate.is_determined);
  EXPECT_NEAR(estimate.camera.fx, 160 / std::tan(M_PI / 6), 0.01);
  ASSERT_EQ(estimate.findings.size(), 1u);
  EXPECT_EQ(estimate.findings[0].severity, Severity::WARNING);
  EXPECT_CONTAINS(estimate.findings[0].what, "do not determine the focal length");
  EXPECT_CONTAINS(estimate.findings[0].remedy, "--intrinsics");
}

TEST(EstimateIntrinsics, OpensARecordingWithoutIntrinsics)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  const TemporaryFolder folder;
  SyntheticScanWriteOptions write;
  write.surface_spacing = 0;
  const std::string place = folder.path("scan");
  writeSyntheticScan(SyntheticScan(scanOf(230)), place, write);
  writeText(place + "/intrinsics.txt", "depth_scale 5000\n");
  EXPECT_THROW(openDataset(place), pcl::IOException);
  const RGBDDataset::Ptr dataset = openWithEstimatedIntrinsics(place);
  EXPECT_NEAR(dataset->camera().fx, 230, 5);
  std::string all;
  for (const Finding& finding : dataset->findings())
    all += finding.what + "\n";
  EXPECT_CONTAINS(all, "from an estimate that started at a field of view of 60 degrees");
  EXPECT_CONTAINS(all, "the focal length was estimated");
}

TEST(EstimateIntrinsics, OptionsServeToOpenSeveralTimes)
{
  const TemporaryFolder folder;
  SyntheticScanWriteOptions write;
  write.surface_spacing = 0;
  const std::string place = folder.path("scan");
  writeSyntheticScan(SyntheticScan(scanOf(230)), place, write);
  IntrinsicsEstimateOptions few;
  few.num_frames = 3;
  DatasetOptions options = withEstimatedIntrinsics(place, {}, few);
  EXPECT_FALSE(options.field_of_view);
  options.depth_factor = 1.01;
  const RGBDDataset::Ptr dataset = openDataset(place, options);
  EXPECT_EQ(dataset->camera().fx, options.intrinsics->fx);
  std::string all;
  for (const Finding& finding : dataset->findings())
    all += finding.what + "\n";
  EXPECT_CONTAINS(all, "from an estimate that started at a field of view of 60 degrees");
  EXPECT_CONTAINS(all, "do not determine the focal length");
}

TEST(EstimateIntrinsics, RefusesInvalidOptions)
{
  const auto message = [](const IntrinsicsEstimateOptions& options) {
    return messageOf<pcl::BadArgumentException>(
        [&] { estimateIntrinsics(SyntheticScan(scanOf(262)), options); });
  };
  IntrinsicsEstimateOptions options;
  options.field_of_view = 0;
  EXPECT_CONTAINS(message(options), "estimateIntrinsics: field_of_view must lie in");
  options = {};
  options.lowest = 1.2;
  EXPECT_CONTAINS(message(options), "lowest must lie in (0, 1]");
  options = {};
  options.num_frames = 1;
  EXPECT_CONTAINS(message(options), "num_frames must be >= 2");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
  DatasetOptions dataset;
  dataset.field_of_view = 3;
  std::string error;
  EXPECT_FALSE(dataset.isValid(&error));
  EXPECT_CONTAINS(error, "field of view");
}
