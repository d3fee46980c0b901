// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/pnp_pose.h"

#include "scenes.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Points in the world and the pixels in which a camera sees them. */
struct SeenPoints {
  CameraIntrinsics camera = smallCamera(640, 480, 525);
  Pose truth; // world from camera
  std::vector<cv::Point2d> pixels;
  std::vector<Eigen::Vector3d> points;
  std::mt19937 random{3};

  SeenPoints(std::size_t size, const Pose& world_from_camera, double pixel_sigma = 0)
  : truth(world_from_camera)
  {
    std::normal_distribution<double> noise;
    for (std::size_t i = 0; i < size; ++i) {
      const Eigen::Vector2d pixel = anyPixel();
      std::uniform_real_distribution<double> depth(1, 4);
      points.push_back(truth * camera.unproject(pixel.x(), pixel.y(), depth(random)));
      const double du = noise(random), dv = noise(random);
      pixels.emplace_back(pixel.x() + pixel_sigma * du, pixel.y() + pixel_sigma * dv);
    }
  }

  /** Replaces the first pixels by arbitrary ones. */
  void
  mismatch(std::size_t count)
  {
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d pixel = anyPixel();
      pixels[i] = {pixel.x(), pixel.y()};
    }
  }

  std::optional<RigidAlignment>
  pose() const
  {
    return estimatePnPPose(camera, pixels, points);
  }

  /** Of the camera in its own frame. */
  Vector6d
  error() const
  {
    const std::optional<RigidAlignment> found = pose();
    if (found)
      return logarithm(truth.inverse() * found->target_from_source);
    ADD_FAILURE() << "no pose";
    return Vector6d::Zero();
  }

private:
  Eigen::Vector2d
  anyPixel()
  {
    std::uniform_real_distribution<double> uniform(0, 1);
    const double u = uniform(random), v = uniform(random);
    return {639 * u, 479 * v};
  }
};

} // namespace

TEST(PnPPose, ExactPixelsGiveTheExactPose)
{
  for (unsigned seed = 0; seed < 5; ++seed) {
    const SeenPoints seen(30, randomMotion(seed, 2.5, 3));
    EXPECT_LT(seen.error().norm(), 1e-5);
    EXPECT_EQ(seen.pose()->inliers.size(), 30u);
  }
}

TEST(PnPPose, LeavesWhatItDoesNotMeasureUnset)
{
  const std::optional<RigidAlignment> pose = SeenPoints(30, randomMotion(1, 1, 1), 0.5).pose();
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->rmse, 0);
  EXPECT_EQ(pose->scale, 1);
  EXPECT_TRUE(isRigid(pose->target_from_source.matrix(), 1e-9));
}

TEST(PnPPose, OutliersDoNotMoveIt)
{
  for (const std::size_t outliers : {20, 60, 100}) {
    SeenPoints seen(200, randomMotion(2, 1, 1), 0.5);
    seen.mismatch(outliers);
    EXPECT_LT(seen.error().norm(), 0.01) << outliers;
    EXPECT_NEAR(double(seen.pose()->inliers.size()), 200.0 - double(outliers), 8);
  }
}

TEST(PnPPose, ErrorShrinksWithTheNoiseAndWithMorePoints)
{
  const auto rmsError = [](std::size_t size, double sigma) {
    double squared = 0;
    constexpr unsigned RUNS = 20;
    for (unsigned seed = 0; seed < RUNS; ++seed) {
      SeenPoints seen(size, randomMotion(seed, 1, 1), sigma);
      squared += seen.error().squaredNorm() / RUNS;
    }
    return std::sqrt(squared);
  };
  const double usual = rmsError(100, 0.5);
  EXPECT_LT(usual, 0.01) << "half a pixel is a milliradian; a hundred points average it";
  EXPECT_NEAR(rmsError(100, 0.25) / usual, 0.5, 0.1);
  EXPECT_NEAR(rmsError(400, 0.5) / usual, 0.5, 0.15);
}

TEST(PnPPose, PointsOfAPlaneSuffice)
{
  SeenPoints seen(40, Pose::Identity());
  for (std::size_t i = 0; i < seen.points.size(); ++i)
    seen.points[i] *= 2 / seen.points[i].z(); // in the same pixels, at 2 m
  EXPECT_LT(seen.error().norm(), 1e-4);
}

TEST(PnPPose, FollowsTheWorldFrame)
{
  SeenPoints seen(60, randomMotion(4, 0.5, 0.5), 0.5);
  seen.mismatch(10);
  const std::optional<RigidAlignment> here = seen.pose();
  const Pose world = randomMotion(5, 2, 4);
  for (Eigen::Vector3d& point : seen.points)
    point = world * point;
  const std::optional<RigidAlignment> there = seen.pose();
  ASSERT_TRUE(here && there);
  EXPECT_EQ(there->inliers.size(), here->inliers.size());
  const Pose expected = world * here->target_from_source;
  EXPECT_LT(logarithm(expected.inverse() * there->target_from_source).norm(), 1e-4);
}

TEST(PnPPose, IsTheSameInEveryRun)
{
  SeenPoints seen(100, randomMotion(6, 1, 1), 1);
  seen.mismatch(50);
  const std::optional<RigidAlignment> first = seen.pose(), again = seen.pose();
  ASSERT_TRUE(first && again);
  EXPECT_EQ(first->target_from_source.matrix(), again->target_from_source.matrix());
}

TEST(PnPPose, FewPointsOrNoConsensusGiveNone)
{
  EXPECT_FALSE(SeenPoints(0, Pose::Identity()).pose());
  EXPECT_FALSE(SeenPoints(5, Pose::Identity()).pose()) << "a sample of four and one to check it";
  EXPECT_TRUE(SeenPoints(6, Pose::Identity()).pose());
  SeenPoints wrong(8, Pose::Identity());
  wrong.mismatch(8);
  EXPECT_FALSE(wrong.pose());
  SeenPoints half(10, Pose::Identity());
  half.mismatch(5);
  EXPECT_FALSE(half.pose()) << "only five agree";
}
