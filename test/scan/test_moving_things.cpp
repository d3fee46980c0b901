// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What moves takes neither the poses nor the surface.
#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/reconstruction.h>

#include "changed_scan.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <pcl/conversions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** With a person who passes before the camera within the first 1.5 s. */
SyntheticScanOptions
passingPerson()
{
  SyntheticScanOptions options = noisyScan(24);
  options.seed = 3;
  options.start_time = 39;
  options.frame_rate = 6;
  options.person = true;
  return options;
}

ReconstructionResult
reconstructed(const SyntheticScan& scan)
{
  ReconstructionOptions options;
  options.volume.voxel_size = 0.02;
  options.volume.truncation = 0.08;
  return reconstruct(scan, options);
}

double
ate(const SyntheticScan& scan, const ReconstructionResult& result)
{
  return absoluteTrajectoryError(scan.groundTruth(), result.trajectory())->translation.rmse;
}

/** Share of the mesh's vertices that lie far from the true surface of the room. */
double
shareFarFromSurface(const SyntheticScan& scan, const ReconstructionResult& result)
{
  const Pose truth_from_world =
      absoluteTrajectoryError(scan.groundTruth(), result.trajectory())->truth_from_estimate;
  pcl::PointCloud<pcl::PointXYZ> vertices;
  pcl::fromPCLPointCloud2(result.mesh.cloud, vertices);
  std::size_t far = 0;
  for (const pcl::PointXYZ& vertex : vertices)
    far += scan.distanceToSurface(truth_from_world * vertex.getVector3fMap().cast<double>()) > 0.1;
  return double(far) / double(vertices.size());
}

} // namespace

TEST(ReconstructMovingThings, APersonIsInNeitherPosesNorSurface)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  SyntheticScanOptions options = passingPerson();
  const SyntheticScan with(options);
  options.person = false;
  const SyntheticScan without(options);
  const ReconstructionResult result = reconstructed(with), clean = reconstructed(without);
  EXPECT_LT(ate(with, result), 2 * ate(without, clean));
  EXPECT_EQ(result.verdict(), Verdict::GOOD);
  EXPECT_LT(shareFarFromSurface(with, result), 0.01);
  int found = 0, shown = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const RGBDFrame frame = with.read(i), empty = without.read(i);
    const double person = cv::countNonZero((frame.depth > 0) & (empty.depth - frame.depth > 0.1));
    const double share = person / cv::countNonZero(frame.depth > 0);
    shown += share > 0.02;
    found += share > 0.02 && result.frames[i].moving_share > 0.7 * share;
    EXPECT_LT(result.frames[i].moving_share, 2 * share + 0.001) << i;
    EXPECT_EQ(clean.frames[i].moving_share, 0) << i;
  }
  EXPECT_GT(shown, 5);
  EXPECT_GE(found, 0.8 * shown);
}

TEST(ReconstructMovingThings, ABoardOfMuchTextureIsSaid)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  cv::Mat cells(40, 30, CV_8UC3), texture;
  cv::RNG(3).fill(cells, cv::RNG::UNIFORM, 0, 255);
  cv::resize(cells, texture, {100, 160}, 0, 0, cv::INTER_NEAREST);
  ChangedScan scan;
  scan.change = [&](std::size_t index, RGBDFrame& frame) {
    const cv::Rect place({9 * int(index), 50}, texture.size());
    texture.copyTo(frame.color(place));
    frame.depth(place) = 0.7;
  };
  ReconstructionOptions options;
  options.make_mesh = false;
  const ReconstructionResult result = reconstruct(scan, options);
  EXPECT_NE(result.verdict(), Verdict::GOOD);
  EXPECT_TRUE(
      std::any_of(result.findings.begin(), result.findings.end(), [](const Finding& finding) {
        return finding.kind == "two_motions" && finding.severity == Severity::WARNING;
      }));
}
