// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What is said of the uncertainty of final poses is true.
#include <bundle_icp/reconstruction.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "noisy_scan.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

using namespace bundle_icp;

namespace {

/** With all faults of a camera, at the table and along the walls. */
SyntheticScan
scanOf(std::uint64_t seed)
{
  SyntheticScanOptions options = test::noisyScan(30, 262.5);
  options.seed = seed;
  options.start_time = seed % 2 ? 67 : 0;
  return SyntheticScan(options);
}

ReconstructionResult
posesOf(const SyntheticScan& scan)
{
  ReconstructionOptions options;
  options.make_mesh = false;
  return reconstruct(scan, options);
}

/** Rotation and position, along the axes of the world. */
Vector6d
errorOf(const Pose& pose, const Pose& truth)
{
  Pose turn = Pose::Identity();
  turn.linear() = pose.linear() * truth.linear().transpose();
  Vector6d error = logarithm(turn);
  error.tail<3>() = pose.translation() - truth.translation();
  return error;
}

} // namespace

TEST(FinalDeviations, AreThoseOfTheErrors)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  double sum = 0, position = 0, foretold = 0;
  std::size_t count = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const SyntheticScan scan = scanOf(seed);
    const ReconstructionResult result = posesOf(scan);
    ASSERT_TRUE(result.frames[0].registered);
    EXPECT_EQ(result.frames[0].position_deviation, 0) << "the first frame is the world";
    double of_scan = 0;
    std::size_t frames = 0;
    for (std::size_t i = 1; i < scan.size(); ++i) {
      const FrameReport& frame = result.frames[i];
      if (!frame.registered)
        continue;
      const Vector6d error = errorOf(frame.world_from_camera,
                                     scan.worldFromCamera(0).inverse() * scan.worldFromCamera(i));
      of_scan += error.dot(frame.covariance.ldlt().solve(error)) / 6;
      position += error.tail<3>().squaredNorm();
      const double squared = frame.covariance.bottomRightCorner<3, 3>().trace();
      foretold += squared;
      const Eigen::SelfAdjointEigenSolver<Matrix6d> all(frame.covariance);
      EXPECT_GT(all.eigenvalues()[0], 0);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of_position(
          frame.covariance.bottomRightCorner<3, 3>());
      EXPECT_NEAR(frame.position_deviation, std::sqrt(of_position.eigenvalues()[2]), 1e-9);
      ++frames;
    }
    EXPECT_LT(of_scan / double(frames), 4) << "seed " << seed;
    sum += of_scan;
    count += frames;
  }
  ASSERT_GT(count, 100u);
  RecordProperty("nees", std::to_string(sum / double(count)));
  EXPECT_GT(sum / double(count), 0.4);
  EXPECT_LT(sum / double(count), 2);
  EXPECT_GT(std::sqrt(position / foretold), 0.4);
  EXPECT_LT(std::sqrt(position / foretold), 1.5);
}

TEST(FinalDeviations, DoNotDependOnTheNumberOfThreads)
{
  SyntheticScanOptions scene;
  scene.num_frames = 8;
  scene.frame_rate = 3;
  scene.width = 320;
  scene.height = 240;
  scene.focal_length = 262.5;
  const SyntheticScan scan(scene);
  ReconstructionOptions options;
  options.make_mesh = false;
  options.num_threads = 1;
  const ReconstructionResult one = reconstruct(scan, options);
  options.num_threads = 2;
  const ReconstructionResult two = reconstruct(scan, options);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    EXPECT_EQ(one.frames[i].covariance, two.frames[i].covariance) << i;
    EXPECT_EQ(one.frames[i].position_deviation > 0, i > 0) << i;
  }
}
