// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/adjustment_terms.h"

#include "adjustment/dense_system.h"
#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Images = std::vector<std::size_t>;

Images
imagesOf(const AdjustmentTerms& terms)
{
  Images frames;
  for (const AdjustedFrame& frame : terms.frames)
    frames.push_back(frame.frame);
  return frames;
}

/** Poses of six frames without a single track. */
struct PosesAlone : LandmarkScene {
  PosesAlone()
  {
    model = SparseModel(views.size());
    for (std::size_t i = 0; i < views.size(); ++i)
      model.registerFrame(i, views[i].world_from_camera, 0);
  }
};

/** Cost of a scene as it is. */
double
costOf(const LandmarkScene& scene, const BundleAdjustmentOptions& options = {})
{
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  return terms.cost(terms.initialState(scene.model), 1);
}

} // namespace

TEST(AdjustmentTerms, ListWhatMovesFirst)
{
  const BundleAdjustmentOptions options;
  LandmarkScene scene;
  scene.problem.variable = {4, 1, 3, 1};
  const auto terms = [&] {
    return AdjustmentTerms(scene.graph, scene.problem, options, scene.model);
  };
  EXPECT_EQ(imagesOf(terms()), (Images{1, 3, 4})); // 4 fixes the gauge
  EXPECT_EQ(terms().num_moving, 2u);
  EXPECT_FALSE(terms().frames[2].pose_moves);
  scene.problem.depth_errors = true; // of which 4 has one like any other
  EXPECT_EQ(imagesOf(terms()), (Images{4, 1, 3}));
  EXPECT_EQ(terms().num_moving, 3u);
  EXPECT_FALSE(terms().frames[0].pose_moves);
  EXPECT_TRUE(terms().frames[0].depth_error_moves);
  scene.problem.constant = {3, 0, 0}; // held, though it is to move as well
  EXPECT_EQ(imagesOf(terms()), (Images{4, 1, 3, 0}));
  EXPECT_EQ(terms().num_moving, 2u);
  for (const AdjustedFrame& frame : terms().frames)
    EXPECT_EQ(frame.pose_moves, frame.frame == 4 || frame.frame == 1) << frame.frame;
}

TEST(AdjustmentTerms, ObservationsLieByPointInChunks)
{
  const BundleAdjustmentOptions options;
  const LandmarkScene scene;
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  ASSERT_EQ(terms.first_observation.size(), terms.points.size() + 1);
  EXPECT_EQ(terms.first_observation.back(), terms.observations.size());
  for (std::size_t p = 0; p < terms.points.size(); ++p) {
    const std::vector<Observation>& track = scene.model.points()[terms.points[p]].track;
    const std::size_t first = terms.first_observation[p];
    ASSERT_EQ(terms.first_observation[p + 1] - first, track.size());
    for (std::size_t k = 0; k < track.size(); ++k) {
      EXPECT_EQ(terms.observations[first + k].point, int(p));
      EXPECT_EQ(terms.frames[std::size_t(terms.observations[first + k].frame)].frame,
                track[k].frame);
    }
  }
  ASSERT_GT(terms.numChunks(), 1u);
  std::size_t next = 0;
  for (std::size_t chunk = 0; chunk < terms.numChunks(); ++chunk) {
    EXPECT_EQ(terms.pointsOf(chunk).first, next);
    EXPECT_GT(terms.pointsOf(chunk).second, next);
    next = terms.pointsOf(chunk).second;
  }
  EXPECT_EQ(next, terms.points.size());
}

TEST(AdjustmentTerms, UsePointsThatAMovingImageAndAnotherOneSee)
{
  const BundleAdjustmentOptions options;
  LandmarkScene scene;
  scene.problem.variable = {1};
  std::size_t seen_alone = 0;
  for (const std::size_t other : {0, 2, 3, 4, 5}) {
    scene.problem.constant = {other};
    std::size_t seen_by_both = 0;
    for (const ScenePoint& point : scene.model.points()) {
      std::set<std::size_t> seen_by;
      for (const Observation& o : point.track)
        seen_by.insert(o.frame);
      seen_by_both += seen_by.count(1) && seen_by.count(other);
      seen_alone += seen_by.count(1) && !seen_by.count(other);
    }
    EXPECT_GT(seen_by_both, 0u);
    for (const std::size_t min_length : {0, 1, 2, 3}) { // there are no tracks of three frames
      scene.problem.min_track_length = min_length;
      const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
      EXPECT_EQ(terms.points.size(), min_length < 3 ? seen_by_both : 0) << other;
    }
  }
  EXPECT_GT(seen_alone, 0u);
}

TEST(AdjustmentTerms, DropPairsWithAnImageThatTakesNoPart)
{
  const BundleAdjustmentOptions options;
  PosesAlone scene;
  scene.problem.variable = {0, 1, 2};
  for (const auto& [first, second] : {std::pair(0, 1), {2, 5}, {5, 2}, {1, 1}, {2, 0}})
    scene.problem.relative_poses.push_back({std::size_t(first), std::size_t(second)});
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  ASSERT_EQ(terms.pairs.size(), 2u);
  EXPECT_EQ(terms.numResiduals(), 12u);
  EXPECT_EQ(terms.frames[std::size_t(terms.pairs[1].first)].frame, 2u);
  EXPECT_EQ(terms.frames[std::size_t(terms.pairs[1].second)].frame, 0u);
}

TEST(AdjustmentTerms, CostOfARelativePoseIsItsQuadraticForm)
{
  PosesAlone scene;
  Vector6d delta;
  delta << 0.02, -0.01, 0.03, 0.05, -0.02, 0.01;
  RelativePoseTerm term{2, 4};
  term.information = Vector6d(1, 2, 3, 4, 5, 6).asDiagonal();
  // The present relative pose is the measured one, moved by delta.
  term.first_from_second = increment(delta).inverse() * scene.views[2].world_from_camera.inverse() *
                           scene.views[4].world_from_camera;
  scene.problem.relative_poses = {term};
  EXPECT_NEAR(costOf(scene), delta.dot(term.information * delta) / 2, 1e-12);
}

TEST(AdjustmentTerms, CostOfPriorsIsTheirSquaresInDeviations)
{
  PosesAlone scene;
  using P = CalibrationParameter;
  Calibration calibration;
  calibration[P::FOCAL_X] = 3 * calibrationPrior()[int(P::FOCAL_X)];
  calibration[P::READOUT] = -2 * calibrationPrior()[int(P::READOUT)];
  scene.model.setCalibration(calibration);
  scene.model.setDepthError(4, {1, 2, -2});
  EXPECT_EQ(costOf(scene), 0); // nothing of it moves
  scene.problem.calibrated = {P::READOUT};
  EXPECT_NEAR(costOf(scene), (9 + 4) / 2.0, 1e-12);
  scene.problem.depth_errors = true;
  BundleAdjustmentOptions options;
  options.depth_error_deviation = 0.5;
  EXPECT_NEAR(costOf(scene, options), (9 + 4 + 9 / 0.25) / 2, 1e-12);
  scene.problem.variable = {0, 1, 2}; // 4 takes no part
  EXPECT_NEAR(costOf(scene, options), (9 + 4) / 2.0, 1e-12);
}

TEST(AdjustmentTerms, CostOfDepthIsRobust)
{
  LandmarkScene scene;
  const double before = costOf(scene);
  scene.model.setDepthError(2, {4, 0, 0}); // each depth of frame 2 is off by four sigma
  std::size_t seen = 0;
  for (const ScenePoint& point : scene.model.points())
    for (const Observation& o : point.track)
      seen += o.frame == 2;
  ASSERT_GT(seen, 50u);
  EXPECT_NEAR(costOf(scene) - before, double(seen) * 4 * std::log1p(16.0 / 4) / 2,
              1e-3 * double(seen));
  BundleAdjustmentOptions options;
  options.loss_scale = 1e4; // as good as none
  EXPECT_NEAR(costOf(scene, options) - before, double(seen) * 16.0 / 2, 1e-3 * double(seen));
  options.use_depth = false;
  EXPECT_LT(costOf(scene, options), 1e-2);
}

TEST(AdjustmentTerms, GradientIsThatOfTheCost)
{
  NoisyScene scene(4);
  complicate(scene);
  const BundleAdjustmentOptions options;
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  AdjustmentState state = terms.initialState(scene.model);
  state.depth_errors[1] = {0.3, -0.2, 0.1};
  const DenseSystem<9> dense(terms, state, 0);
  const Eigen::VectorXd gradient = dense.gradient();
  ASSERT_FALSE(terms.frames[0].pose_moves);
  EXPECT_EQ(gradient.head<6>().norm(), 0); // held, so that its slope has no part
  // All other unknowns of frames and of the calibration, and those of a few points
  for (Eigen::Index k = 6; k < dense.firstPoint() + 9; ++k) {
    const auto cost = [&](double step) {
      return terms.cost(dense.moved(terms, state, step * Eigen::VectorXd::Unit(gradient.size(), k)),
                        1);
    };
    const double numeric = (cost(1e-6) - cost(-1e-6)) / 2e-6;
    EXPECT_NEAR(gradient[k], numeric, 1e-4 * (1 + std::abs(numeric))) << k;
  }
}

TEST(AdjustmentTerms, CostDoesNotDependOnThreads)
{
  const NoisyScene scene(6);
  const BundleAdjustmentOptions options;
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  const AdjustmentState state = terms.initialState(scene.model);
  for (const int num_threads : {2, 3, 8})
    EXPECT_EQ(terms.cost(state, num_threads), terms.cost(state, 1));
}

TEST(AdjustmentTerms, WriteBackWhatMovesAlone)
{
  const BundleAdjustmentOptions options;
  LandmarkScene scene;
  scene.problem.variable = {1, 2};
  scene.problem.constant = {0};
  scene.problem.calibrated = {CalibrationParameter::FOCAL_X};
  Calibration calibration;
  calibration.deviations[3] = 0.7;
  scene.model.setCalibration(calibration);
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  AdjustmentState state = terms.initialState(scene.model);
  for (std::size_t i = 0; i < terms.frames.size(); ++i)
    state.poses[i] = PoseBlock(randomMotion(unsigned(i), 0.4, 0.5));
  state.points.front() = {1, 2, 3};
  state.calibration[0] = 0.01;
  SparseModel model = scene.model;
  terms.writeBack(state, model);
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    EXPECT_EQ(model.worldFromCamera(i).matrix() != scene.model.worldFromCamera(i).matrix(),
              i == 1 || i == 2)
        << i;
  EXPECT_LT((model.worldFromCamera(2).matrix() - randomMotion(1, 0.4, 0.5).matrix()).norm(), 1e-12);
  EXPECT_EQ(model.points()[terms.points.front()].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(model.calibration()[CalibrationParameter::FOCAL_X], 0.01);
  EXPECT_EQ(model.calibration().deviations, calibration.deviations);
}
