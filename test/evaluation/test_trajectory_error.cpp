// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/evaluation/trajectory_error.h>

#include <gtest/gtest.h>

#include <cmath>

using namespace bundle_icp;

namespace {

TimedPose
at(double timestamp, double x, double y, double z, double angle = 0)
{
  TimedPose pose;
  pose.timestamp = timestamp;
  pose.world_from_camera.translation() << x, y, z;
  pose.world_from_camera.linear() =
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

Pose
someMotion()
{
  Vector6d motion;
  motion << 0.3, -0.5, 1.2, 4, -5, 6;
  return increment(motion);
}

// Poses at 10 Hz along x, `step` m apart, turning by `turn` rad each.
Trajectory
line(int num_poses, double step, double turn = 0)
{
  Trajectory trajectory;
  for (int i = 0; i < num_poses; ++i)
    trajectory.push_back(at(0.1 * i, step * i, 0, 0, turn * i));
  return trajectory;
}

} // namespace

TEST(ErrorStatistics, OfFourNumbers)
{
  const ErrorStatistics s = errorStatistics({4, 1, 3, 2});
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5)); // (1 + 4 + 9 + 16) / 4
  EXPECT_DOUBLE_EQ(s.max, 4);
  EXPECT_DOUBLE_EQ(errorStatistics({5, 1, 2}).median, 2);
  EXPECT_EQ(errorStatistics({}).count, 0u);
}

TEST(AbsoluteTrajectoryError, OfASquareTenPercentTooLarge)
{
  // The true positions are the corners of a unit square. Those of the estimate are a
  // tenth farther from the centre, in another world frame. The best rigid alignment
  // puts centre on centre and diagonals on diagonals, and leaves a tenth of half a
  // diagonal at each corner: 0.1 * sqrt(2) / 2 = 0.0707107 m. Scale must not be
  // adjusted.
  const Trajectory truth = {at(0, 0, 0, 0), at(1, 1, 0, 0), at(2, 1, 1, 0), at(3, 0, 1, 0)};
  Trajectory estimate;
  const Eigen::Vector3d centre(0.5, 0.5, 0);
  for (TimedPose pose : truth) {
    pose.world_from_camera.translation() =
        centre + 1.1 * (pose.world_from_camera.translation() - centre);
    pose.world_from_camera = someMotion() * pose.world_from_camera;
    pose.timestamp += 0.015; // within 20 ms
    estimate.push_back(pose);
  }
  const auto error = absoluteTrajectoryError(truth, estimate);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->translation.count, 4u);
  EXPECT_NEAR(error->translation.rmse, 0.1 * std::sqrt(2) / 2, 1e-12);
  EXPECT_NEAR(error->translation.mean, 0.1 * std::sqrt(2) / 2, 1e-12);
  EXPECT_NEAR(error->translation.median, 0.1 * std::sqrt(2) / 2, 1e-12);
  EXPECT_NEAR(error->translation.max, 0.1 * std::sqrt(2) / 2, 1e-12);
  EXPECT_TRUE(error->truth_from_estimate.isApprox(someMotion().inverse(), 1e-12));
  EXPECT_FALSE(absoluteTrajectoryError(truth, estimate, 0.01));
}

TEST(AbsoluteTrajectoryError, NeedsThreePairs)
{
  const Trajectory truth = line(3, 0.1);
  EXPECT_FALSE(absoluteTrajectoryError(truth, line(2, 0.1)));
  EXPECT_FALSE(absoluteTrajectoryError({}, {}));
  const auto error = absoluteTrajectoryError(truth, truth);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->translation.rmse, 0, 1e-12);
}

TEST(RelativePoseError, OfALineTenPercentTooLong)
{
  // 31 poses at 10 Hz, 0.1 m apart; estimated 0.11 m apart.
  const Trajectory truth = line(31, 0.1), estimate = line(31, 0.11);
  // Frame: (0, 1) ... (28, 29), as pairs that end at the last pose are left out.
  const auto frame = relativePoseError(truth, estimate, RelativePoseInterval::FRAME);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->translation.count, 29u);
  EXPECT_NEAR(frame->translation.rmse, 0.01, 1e-12);
  EXPECT_NEAR(frame->rotation.max, 0, 1e-9);
  // Second: (0, 10) ... (19, 29).
  const auto second = relativePoseError(truth, estimate, RelativePoseInterval::SECOND);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->translation.count, 20u);
  EXPECT_NEAR(second->translation.mean, 0.1, 1e-12);
  // All 31 * 31 pairs, with errors of 0.01 |i - j|: the mean of |i - j| over n x n
  // pairs is (n^2 - 1) / (3 n) = 960 / 93, that of its square (n^2 - 1) / 6 = 160.
  const auto all = relativePoseError(truth, estimate, RelativePoseInterval::ALL_PAIRS);
  ASSERT_TRUE(all);
  EXPECT_EQ(all->translation.count, 961u);
  EXPECT_NEAR(all->translation.mean, 0.01 * 960 / 93, 1e-12);
  EXPECT_NEAR(all->translation.rmse, 0.01 * std::sqrt(160), 1e-12);
  EXPECT_NEAR(all->translation.max, 0.3, 1e-12);
}

TEST(RelativePoseError, OfRotation)
{
  // 0.02 rad too much between frames, on the spot.
  const Trajectory truth = line(31, 0), estimate = line(31, 0, 0.02);
  const auto frame = relativePoseError(truth, estimate, RelativePoseInterval::FRAME);
  const auto second = relativePoseError(truth, estimate, RelativePoseInterval::SECOND);
  ASSERT_TRUE(frame && second);
  EXPECT_NEAR(frame->rotation.rmse, 0.02, 1e-12);
  EXPECT_NEAR(frame->translation.max, 0, 1e-12);
  EXPECT_NEAR(second->rotation.mean, 0.2, 1e-12);
}

TEST(RelativePoseError, DoesNotDependOnTheWorldFrames)
{
  const Trajectory truth = line(31, 0.1, 0.01), estimate = line(31, 0.11, 0.02);
  Trajectory moved = estimate;
  for (TimedPose& pose : moved)
    pose.world_from_camera = someMotion() * pose.world_from_camera;
  const auto a = relativePoseError(truth, estimate, RelativePoseInterval::ALL_PAIRS);
  const auto b = relativePoseError(truth, moved, RelativePoseInterval::ALL_PAIRS);
  EXPECT_NEAR(a->translation.rmse, b->translation.rmse, 1e-12);
  EXPECT_NEAR(a->rotation.rmse, b->rotation.rmse, 1e-12);
}

TEST(RelativePoseError, LeavesOutPosesFarFromTheTruth)
{
  // The truth ends at 2 s; poses more than two of its intervals later have no partner.
  const Trajectory truth = line(21, 0.1), estimate = line(31, 0.1);
  const auto frame = relativePoseError(truth, estimate, RelativePoseInterval::FRAME);
  ASSERT_TRUE(frame);
  // Poses 0 to 22 take part: 2.2 s is two intervals after the end, and (21, 22) the
  // last pair. (Rounding decides about pose 22 itself, so it may be missing.)
  EXPECT_GE(frame->translation.count, 21u);
  EXPECT_LE(frame->translation.count, 22u);
}

TEST(RelativePoseError, NeedsTwoPairs)
{
  const auto interval = RelativePoseInterval::FRAME;
  EXPECT_FALSE(relativePoseError(line(5, 1), line(3, 1), interval)); // (0, 1) only
  EXPECT_TRUE(relativePoseError(line(5, 1), line(4, 1), interval));
  EXPECT_FALSE(relativePoseError(line(1, 1), line(4, 1), interval));
  EXPECT_FALSE(relativePoseError({}, {}, RelativePoseInterval::ALL_PAIRS));
}

TEST(RelativePoseError, DrawsThePairsThatPythonDraws)
{
  // On the spot; estimated at 1 mm * i. Mean and RMSE were computed by
  //   r = random.Random(0); e = [abs(.001 * (r.randint(0, 149) - r.randint(0, 149)))
  //   ...]
  const auto error =
      relativePoseError(line(150, 0), line(150, 0.001), RelativePoseInterval::ALL_PAIRS);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->translation.count, 10000u);
  EXPECT_NEAR(error->translation.mean, 0.0498058999999994, 1e-10);
  EXPECT_NEAR(error->translation.rmse, 0.0610072020338582, 1e-10);
}

TEST(RelativePoseError, SamplesLongTrajectoriesAsPythonDoes)
{
  // On the spot; estimated at 1 um * i^2, so that the pair (i, i + 1) errs by (2 i + 1)
  // um. Means computed by random.Random(0).sample(range(n - 2), 10000): one for each of
  // its two ways.
  for (const auto& [num_poses, mean] :
       {std::make_pair(12000, 0.0119733901999999), std::make_pair(70000, 0.0694253624)}) {
    Trajectory estimate = line(num_poses, 0);
    for (int i = 0; i < num_poses; ++i)
      estimate[i].world_from_camera.translation().x() = 1e-6 * i * i;
    const auto error = relativePoseError(line(num_poses, 0), estimate, RelativePoseInterval::FRAME);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->translation.count, 10000u);
    EXPECT_NEAR(error->translation.mean, mean, 1e-10) << num_poses;
  }
}

TEST(CountFramesWithPose, CountsEachFrameAndPoseOnce)
{
  const Trajectory estimate = line(3, 1); // at 0, 0.1, 0.2 s
  EXPECT_EQ(countFramesWithPose({0, 0, 0.005, 0.1, 0.15, 0.3}, estimate), 2u);
  EXPECT_EQ(countFramesWithPose({}, estimate), 0u);
}
