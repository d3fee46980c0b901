// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What moves takes neither the poses nor the surface.
#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <gtest/gtest.h>
#include <pcl/conversions.h>

using namespace bundle_icp;

namespace {

/** With a person who passes before the camera within the first 1.5 s. */
SyntheticScanOptions
passingPerson()
{
  SyntheticScanOptions options = SyntheticScanOptions::fullNoise();
  options.seed = 3;
  options.start_time = 39;
  options.num_frames = 24;
  options.frame_rate = 6;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262;
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
