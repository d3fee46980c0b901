// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A camera that stands still, and what moves before it.
#include "messages.h"
#include "noisy_scan.h"

#include <bundle_icp/evaluation/trajectory_error.h>
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include <gtest/gtest.h>
#include <pcl/conversions.h>

#include <algorithm>

using namespace bundle_icp;

namespace {

const SyntheticScan&
turntable()
{
  static const SyntheticScan scan = [] {
    SyntheticScanOptions options = test::noisyScan(36);
    options.turntable = true;
    return SyntheticScan(options);
  }();
  return scan;
}

ReconstructionResult
reconstructed(const SyntheticScan& scan, MovingPart moving, bool make_mesh = true)
{
  ReconstructionOptions options;
  options.moving = moving;
  options.make_mesh = make_mesh;
  options.volume.voxel_size = 0.01;
  options.volume.truncation = 0.05;
  return reconstruct(scan, options);
}

/** The finding of a kind, or one without a kind. */
Finding
findingOf(const ReconstructionResult& result, const std::string& kind)
{
  const auto found = std::find_if(result.findings.begin(), result.findings.end(),
                                  [&kind](const Finding& finding) { return finding.kind == kind; });
  return found == result.findings.end() ? Finding() : *found;
}

pcl::PointCloud<pcl::PointXYZ>
verticesOf(const ReconstructionResult& result)
{
  pcl::PointCloud<pcl::PointXYZ> vertices;
  pcl::fromPCLPointCloud2(result.mesh.cloud, vertices);
  return vertices;
}

} // namespace

TEST(MovingObject, OnATurntableIsReconstructed)
{
  const SyntheticScan& scan = turntable();
  const ReconstructionResult result = reconstructed(scan, MovingPart::OBJECT);
  ASSERT_FALSE(result.component_sizes.empty());
  EXPECT_GE(result.component_sizes.front(), 32u);
  const auto error = absoluteTrajectoryError(scan.groundTruth(), result.trajectory());
  RecordProperty("ate_mm", std::to_string(1000 * error->translation.rmse));
  EXPECT_LT(error->translation.rmse, 0.004);
  EXPECT_NE(result.verdict(), Verdict::DOUBTFUL);
  const Finding finding = findingOf(result, "moving_object");
  EXPECT_EQ(finding.severity, Severity::NOTE);
  EXPECT_CONTAINS(finding.what, "poses and surface are those of the thing");
  std::size_t far = 0;
  const auto vertices = verticesOf(result);
  ASSERT_GT(vertices.size(), 1000u);
  for (const pcl::PointXYZ& vertex : vertices)
    far += scan.distanceToSurface(error->truth_from_estimate *
                                  vertex.getVector3fMap().cast<double>()) > 0.02;
  EXPECT_LT(double(far), 0.03 * double(vertices.size()));
}

TEST(MovingObject, IsLeftOutAndSaidWhereTheSurroundingsAreWanted)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  const ReconstructionResult result = reconstructed(turntable(), MovingPart::CAMERA);
  ASSERT_EQ(result.component_sizes.size(), 1u);
  for (const FrameReport& frame : result.frames)
    if (frame.registered) {
      EXPECT_LT(frame.world_from_camera.translation().norm(), 0.005) << frame.name;
    }
  const Finding finding = findingOf(result, "moving_object");
  EXPECT_EQ(finding.severity, Severity::WARNING);
  EXPECT_CONTAINS(finding.remedy, "--moving object");
  EXPECT_EQ(findingOf(result, "still_camera").severity, Severity::NOTE);
  EXPECT_EQ(result.verdict(), Verdict::USABLE);
  // The things stand within a sphere above the middle of the disc; the table is behind it.
  const Pose camera_from_things = turntable().worldFromCamera(0).inverse();
  const Eigen::Vector3d middle = camera_from_things * Eigen::Vector3d(0, 0, 0.1);
  std::size_t left = 0;
  for (const pcl::PointXYZ& vertex : verticesOf(result))
    left += (vertex.getVector3fMap().cast<double>() - middle).norm() < 0.15;
  EXPECT_LT(left, 200u) << "of some 4000 that the things have";
}

TEST(MovingObject, NeedsACameraThatStandsStill)
{
  SyntheticScanOptions options = test::noisyScan(12);
  const ReconstructionResult result =
      reconstructed(SyntheticScan(options), MovingPart::OBJECT, false);
  const Finding finding = findingOf(result, "moving_object");
  EXPECT_EQ(finding.severity, Severity::FAULT);
  EXPECT_CONTAINS(finding.what, "the camera does not stand still");
  EXPECT_EQ(result.verdict(), Verdict::DOUBTFUL);
}

TEST(MovingObject, IsNotForTrackingByDepthAlone)
{
  ReconstructionOptions options;
  options.moving = MovingPart::OBJECT;
  EXPECT_TRUE(options.isValid());
  options.method = ReconstructionMethod::F2M_ICP;
  std::string error;
  EXPECT_FALSE(options.isValid(&error));
  EXPECT_CONTAINS(error, "moving: f2m_icp");
}

TEST(StillCamera, IsSaidAndCorrectsNoCalibration)
{
  SyntheticScanOptions options = test::noisyScan(16);
  options.still = true;
  options.focal_error = 0.02;
  const ReconstructionResult result =
      reconstructed(SyntheticScan(options), MovingPart::CAMERA, false);
  const Finding finding = findingOf(result, "still_camera");
  EXPECT_EQ(finding.severity, Severity::NOTE);
  EXPECT_CONTAINS(finding.what, "the camera hardly moves: ");
  EXPECT_TRUE(result.self_calibration.calibrated.empty());
  EXPECT_TRUE(result.model.calibration().values.isZero(0));
  EXPECT_EQ(findingOf(result, "moving_object").kind, "");
  EXPECT_EQ(result.verdict(), Verdict::GOOD);
}

TEST(StillCamera, OfAFrozenRecording)
{
  SyntheticScanOptions options; // without noise all images are equal
  options.num_frames = 12;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262;
  options.still = true;
  const ReconstructionResult result =
      reconstructed(SyntheticScan(options), MovingPart::CAMERA, false);
  EXPECT_EQ(result.component_sizes, std::vector<std::size_t>{12});
  EXPECT_CONTAINS(findingOf(result, "still_camera").what,
                  "12 frames lie within 0.0 mm and 0.00 degrees");
  EXPECT_TRUE(result.self_calibration.calibrated.empty());
}

TEST(StillCamera, IsNotOneThatTurnsOnTheSpot)
{
  SyntheticScanOptions options = test::noisyScan(16);
  options.movement = 0;
  const ReconstructionResult result =
      reconstructed(SyntheticScan(options), MovingPart::CAMERA, false);
  EXPECT_EQ(findingOf(result, "still_camera").kind, "");
}
