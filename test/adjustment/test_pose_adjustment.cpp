// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/pose_adjustment.h"

#include "landmarks.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

struct Scene {
  Landmarks landmarks{200};
  LandmarkView view = landmarks.look(randomMotion(3, 0.2, 0.3));

  std::vector<PointObservation>
  observations() const
  {
    std::vector<PointObservation> result;
    for (std::size_t j = 0; j < view.landmarks.size(); ++j)
      result.push_back({int(j), landmarks.point(view.landmarks[j])});
    return result;
  }

  Pose
  adjust(const std::vector<PointObservation>& observations, const DensePoseTerm& dense,
         const Pose& guess, const BundleAdjustmentOptions& options = {}) const
  {
    return adjustPose(toGraph(landmarks, {view}), SparseModel(1), 0, observations, dense, options,
                      false, {guess})
        .world_from_camera;
  }
};

double
distance(const Pose& a, const Pose& b)
{
  return logarithm(a * b.inverse()).norm();
}

} // namespace

TEST(AdjustPose, ReturnsToTheTruth)
{
  const Scene scene;
  const Pose& truth = scene.view.world_from_camera;
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Pose guess = truth * randomMotion(seed, 0.03, 0.03);
    EXPECT_LT(distance(scene.adjust(scene.observations(), {}, guess), truth), 1e-5);
  }
}

TEST(AdjustPose, PixelsAloneSuffice)
{
  const Scene scene;
  const Pose& truth = scene.view.world_from_camera;
  BundleAdjustmentOptions options;
  options.use_depth = false;
  const Pose guess = truth * randomMotion(1, 0.02, 0.02);
  EXPECT_LT(distance(scene.adjust(scene.observations(), {}, guess, options), truth), 1e-5);
}

TEST(AdjustPose, OutliersHardlyMoveIt)
{
  const Scene scene;
  const Pose& truth = scene.view.world_from_camera;
  std::vector<PointObservation> observations = scene.observations();
  for (std::size_t k = 0; k < observations.size(); k += 5)
    observations[k].point += Eigen::Vector3d(0.3, -0.4, 0.2);
  const Pose guess = truth * randomMotion(1, 0.01, 0.01);
  EXPECT_LT(distance(scene.adjust(observations, {}, guess), truth), 2e-3);
}

TEST(AdjustPose, DenseTermHoldsItWhereNothingIsObserved)
{
  const Scene scene;
  DensePoseTerm dense;
  dense.world_from_camera = scene.view.world_from_camera;
  dense.information = 1e4 * Matrix6d::Identity();
  const Pose guess = dense.world_from_camera * randomMotion(1, 0.05, 0.05);
  EXPECT_LT(distance(scene.adjust({}, dense, guess), dense.world_from_camera), 1e-6);
}

TEST(AdjustPose, StrongerEvidenceWins)
{
  const Scene scene;
  const Pose& truth = scene.view.world_from_camera;
  DensePoseTerm dense;
  dense.world_from_camera = randomMotion(9, 0.02, 0.02) * truth;
  dense.information = 1e-2 * Matrix6d::Identity();
  const Pose visual = scene.adjust(scene.observations(), dense, truth);
  EXPECT_LT(distance(visual, truth), 1e-3);
  dense.information = 1e12 * Matrix6d::Identity();
  const Pose held = scene.adjust(scene.observations(), dense, truth);
  EXPECT_LT(distance(held, dense.world_from_camera), 1e-3);
}

TEST(AdjustPose, WithoutAnyEvidenceThePoseIsKnownToBeUnknown)
{
  const Scene scene;
  const Pose guess = randomMotion(2, 0.5, 0.5);
  const PoseEstimate pose = adjustPose(toGraph(scene.landmarks, {scene.view}), SparseModel(1), 0,
                                       {}, {}, {}, false, {guess});
  ASSERT_TRUE(pose.covariance.allFinite());
  EXPECT_GE(largestDeviation(pose.covariance.topLeftCorner<3, 3>()), 0.99);
  EXPECT_GE(largestDeviation(pose.covariance.bottomRightCorner<3, 3>()), 0.99);
}

TEST(AdjustPose, WithoutAnyEvidenceItStays)
{
  const Scene scene;
  const Pose guess = randomMotion(1, 0.5, 0.5);
  const Pose result = scene.adjust({}, {}, guess);
  EXPECT_TRUE(result.matrix().allFinite());
  EXPECT_LT(distance(result, guess), 1e-9);
}

TEST(AdjustPose, FindsTheErrorThatAllDepthShares)
{
  Scene scene;
  const Pose truth = scene.view.world_from_camera;
  const DepthError error(2, -1, 1.5);
  Features& features = scene.view.features;
  for (std::size_t j = 0; j < features.size(); ++j) {
    const Eigen::Vector3d ray =
        scene.landmarks.camera().unproject(features.pixels[j].x(), features.pixels[j].y(), 1);
    const double shared = error.dot(Eigen::Vector3d(1, ray.x(), ray.y()));
    features.depths[j] += float(DepthNoise().sigma(features.depths[j]) * shared);
  }
  const ImageGraph graph = toGraph(scene.landmarks, {scene.view});
  BundleAdjustmentOptions options;
  options.depth_error_deviation = 1e3; // no prior that pulls
  const auto adjust = [&](bool depth_error) {
    return adjustPose(graph, SparseModel(1), 0, scene.observations(), {}, options, depth_error,
                      {truth * randomMotion(1, 0.01, 0.01)});
  };
  const PoseEstimate with = adjust(true), without = adjust(false);
  EXPECT_LT((with.depth_error - error).norm(), 1e-3);
  EXPECT_LT(distance(with.world_from_camera, truth), 1e-5);
  EXPECT_EQ(without.depth_error, DepthError(DepthError::Zero()));
  EXPECT_GT(distance(without.world_from_camera, truth), 1e-4);
  options.depth_error_deviation = 1e-4; // known not to be there
  EXPECT_LT(adjust(true).depth_error.norm(), 1e-3);
}

TEST(AdjustPose, KeepsADepthErrorThatIsHeld)
{
  const Scene scene;
  const PoseEstimate start{scene.view.world_from_camera, DepthError(1, 2, 3)};
  const PoseEstimate result = adjustPose(toGraph(scene.landmarks, {scene.view}), SparseModel(1), 0,
                                         scene.observations(), {}, {}, false, start);
  EXPECT_EQ(result.depth_error, start.depth_error);
}

TEST(AdjustPose, SaysHowWellThePoseIsKnown)
{
  const Scene scene;
  const ImageGraph graph = toGraph(scene.landmarks, {scene.view});
  const auto adjust = [&](std::size_t count) {
    std::vector<PointObservation> observations = scene.observations();
    observations.resize(count);
    return adjustPose(graph, SparseModel(1), 0, observations, {}, {}, false,
                      {scene.view.world_from_camera});
  };
  const std::size_t all = scene.observations().size();
  const PoseEstimate many = adjust(all), few = adjust(all / 4), one = adjust(1);
  // One point is known to 0.7 px: at 262 px and 2 m that is 5 mm.
  const auto rotation = [](const PoseEstimate& pose) {
    return largestDeviation(pose.covariance.topLeftCorner<3, 3>());
  };
  const auto position = [](const PoseEstimate& pose) {
    return largestDeviation(pose.covariance.bottomRightCorner<3, 3>());
  };
  EXPECT_GT(position(many), 5e-3 / std::sqrt(double(all)));
  EXPECT_LT(position(many), 5e-3);
  EXPECT_LT(rotation(many), 5e-3 / 2);
  EXPECT_GT(position(few), 1.5 * position(many));
  // A single point leaves the rotation about it open.
  EXPECT_GT(std::max(rotation(one), position(one)), 1);
}
