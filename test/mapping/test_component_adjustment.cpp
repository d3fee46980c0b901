// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/component_adjustment.h"

#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A component whose poses are off, and what adjusts it, without dense terms. */
struct Component : LandmarkScene {
  MapperOptions options;
  DepthViewProvider no_depth;
  FrameRegistrar registrar{graph, no_depth, options.registration, options.adjustment};
  ComponentAdjuster adjuster;

  explicit Component(const MapperOptions& mapper_options = {}, unsigned num_frames = 6)
  : LandmarkScene(num_frames), options(withoutDenseTerms(mapper_options)),
    adjuster(graph, registrar, options)
  {
    perturb();
  }

  static MapperOptions
  withoutDenseTerms(MapperOptions options)
  {
    options.refinement.num_dense_neighbours = 0;
    return options;
  }
};

/** Frames without features along a gentle path, 30 each second, and how they were measured. */
struct ShakyPath {
  ImageGraph graph{smallCamera()};
  SparseModel model;
  std::vector<Pose> truth;
  std::vector<std::optional<Matrix6d>> covariances;
  static constexpr double SIGMA = 0.004;

  explicit ShakyPath(std::size_t count) : model(count), covariances(count)
  {
    std::mt19937 random(2);
    std::normal_distribution<double> normal(0, SIGMA);
    std::vector<ImageNode> nodes;
    for (std::size_t i = 0; i < count; ++i) {
      const double t = double(i) / 30;
      nodes.push_back({noFeatures(), t});
      Vector6d motion, noise;
      motion << 0.1 * std::sin(2 * t), 0.2 * t, 0, 0.3 * t, 0.1 * std::cos(2 * t), 0.05 * t;
      truth.push_back(increment(motion));
      for (double& value : noise)
        value = normal(random);
      Pose measured = truth.back() * increment((Vector6d() << noise.head<3>(), 0, 0, 0).finished());
      measured.translation() += noise.tail<3>();
      model.registerFrame(i, measured, 0);
      covariances[i] = SIGMA * SIGMA * Matrix6d::Identity();
    }
    graph.append(nodes, true);
  }

  void
  smooth(const MapperOptions& options)
  {
    const DepthViewProvider none;
    FrameRegistrar registrar(graph, none, options.registration, options.adjustment);
    ComponentAdjuster(graph, registrar, options).applyMotionPrior(model, 0, covariances);
  }

  double
  rmsError() const
  {
    double sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      sum += (model.worldFromCamera(i).translation() - truth[i].translation()).squaredNorm();
    return std::sqrt(sum / double(truth.size()));
  }
};

} // namespace

TEST(ComponentAdjuster, BringsAComponentToItsTruth)
{
  Component in_between, finally;
  const double before = in_between.largestPoseError();
  in_between.adjuster.adjustInBetween(in_between.model, 0);
  EXPECT_LT(in_between.largestPoseError(), 0.1 * before);
  finally.adjuster.adjustFinally(finally.model, 0);
  EXPECT_LT(finally.largestPoseError(), 1e-4);
}

TEST(ComponentAdjuster, DropsTheObservationThatDoesNotFit)
{
  Component scene;
  const auto seen_by_all = std::find_if(
      scene.model.points().begin(), scene.model.points().end(),
      [&](const ScenePoint& point) { return point.track.size() == scene.views.size(); });
  ASSERT_NE(seen_by_all, scene.model.points().end());
  const int point = int(seen_by_all - scene.model.points().begin());
  const Observation wrong = seen_by_all->track[2];
  std::vector<LandmarkView> views = scene.views;
  views[wrong.frame].features.pixels[std::size_t(wrong.feature)].x() += 30;
  const ImageGraph graph = toGraph(scene.landmarks, views);
  FrameRegistrar registrar(graph, scene.no_depth, scene.options.registration,
                           scene.options.adjustment);
  for (const bool finally : {false, true}) {
    SparseModel model = scene.model;
    ComponentAdjuster adjuster(graph, registrar, scene.options);
    finally ? adjuster.adjustFinally(model, 0) : adjuster.adjustInBetween(model, 0);
    EXPECT_EQ(model.pointOf(wrong.frame, wrong.feature), -1);
    EXPECT_EQ(model.points()[std::size_t(point)].track.size(), scene.views.size() - 1);
    for (const Observation& o : model.points()[std::size_t(point)].track)
      EXPECT_EQ(model.pointOf(o.frame, o.feature), point);
  }
}

TEST(ComponentAdjuster, LeavesTheOthersAlone)
{
  MapperOptions options;
  options.schedule.global_adjustment = false;
  Component held(options), other;
  for (Component* scene : {&held, &other}) {
    const int component = scene == &other ? 1 : 0; // has no frame
    const SparseModel before = scene->model;
    scene->adjuster.adjustInBetween(scene->model, component);
    scene->adjuster.adjustFinally(scene->model, component);
    for (std::size_t i = 0; i < before.numFrames(); ++i)
      EXPECT_EQ(scene->model.worldFromCamera(i).matrix(), before.worldFromCamera(i).matrix());
    for (std::size_t p = 0; p < before.points().size(); ++p)
      EXPECT_EQ(scene->model.points()[p].position, before.points()[p].position);
  }
}

TEST(ComponentAdjuster, CalibratesWhenAskedAndWhenThereAreEnoughImages)
{
  MapperOptions off;
  off.refinement.self_calibration = false;
  Component without(off, 10), few({}, 6), enough({}, 10);
  for (Component* scene : {&without, &few, &enough}) {
    scene->adjuster.calibrate(scene->model, 0);
    const bool tested = !scene->adjuster.selfCalibration().tests.empty();
    EXPECT_EQ(tested, scene == &enough);
    EXPECT_TRUE(scene->adjuster.selfCalibration().calibrated.empty()); // the camera is exact
  }
}

TEST(MotionPrior, BringsNoisyPosesCloserToTheTruth)
{
  ShakyPath path(60);
  const double before = path.rmsError();
  EXPECT_NEAR(before, std::sqrt(3) * ShakyPath::SIGMA, 0.2 * before);
  path.smooth({});
  EXPECT_LT(path.rmsError(), 0.6 * before);
}

TEST(MotionPrior, NeedsImagesInTimeAndTheUsersConsent)
{
  MapperOptions without_prior, unordered;
  without_prior.refinement.motion_prior = false;
  unordered.schedule.ordered_in_time = false;
  const auto isMoved = [](std::size_t count, const MapperOptions& options) {
    ShakyPath path(count);
    const double before = path.rmsError();
    path.smooth(options);
    return path.rmsError() != before;
  };
  EXPECT_FALSE(isMoved(40, without_prior));
  EXPECT_FALSE(isMoved(40, unordered));
  EXPECT_FALSE(isMoved(19, {})); // too few to show how the camera moves
  EXPECT_TRUE(isMoved(20, {}));
}

TEST(NumberBySize, AComponentThatHasLostItsFramesLeavesNoGap)
{
  SparseModel model(5);
  const int components[] = {2, 2, 4, 4, 4}; // 0, 1 and 3 are empty
  for (std::size_t i = 0; i < 5; ++i)
    model.registerFrame(i, Pose::Identity(), components[i]);
  numberBySize(model);
  const int expected[] = {1, 1, 0, 0, 0};
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(model.component(i), expected[i]) << i;
}

TEST(NumberBySize, TheLargestComponentIsNumberZero)
{
  SparseModel model(9);
  const int components[] = {0, 1, 1, 2, 1, 2, -1, 3, 3};
  for (std::size_t i = 0; i < 9; ++i)
    if (components[i] >= 0)
      model.registerFrame(i, randomMotion(unsigned(i), 1, 1), components[i]);
  numberBySize(model);
  const int expected[] = {3, 0, 0, 1, 0, 1, -1, 2, 2}; // 2 before 3, which is as large
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(model.component(i), expected[i]) << i;
    if (components[i] >= 0) {
      EXPECT_EQ(model.worldFromCamera(i).matrix(), randomMotion(unsigned(i), 1, 1).matrix());
    }
  }
}
