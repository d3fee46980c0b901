// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/adjustment/bundle_adjustment.h>

#include "adjustment/held_back.h"
#include "landmarks.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <cmath>
#include <random>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Exact views of landmarks, all registered at their true poses. */
struct Scene {
  Landmarks landmarks{150};
  std::vector<LandmarkView> views;
  ImageGraph graph;
  SparseModel model;
  BundleAdjustmentProblem problem;

  explicit Scene(unsigned num_frames = 6)
  : views(landmarkViews(landmarks, num_frames)), graph(toGraph(landmarks, views)), model(num_frames)
  {
    for (std::size_t i = 0; i < views.size(); ++i) {
      model.registerFrame(graph, i, views[i].world_from_camera, 0, {});
      problem.variable.push_back(i);
    }
  }

  /** Moves all poses but the first, and all points. */
  void
  perturb()
  {
    for (std::size_t i = 1; i < views.size(); ++i)
      model.setWorldFromCamera(i, randomMotion(i, 0.01, 0.02) * views[i].world_from_camera);
    for (std::size_t p = 0; p < model.points().size(); ++p)
      model.setPosition(p, randomMotion(p, 0, 0.02) * model.points()[p].position);
  }

  double
  largestPoseError() const
  {
    double largest = 0;
    for (std::size_t i = 0; i < views.size(); ++i)
      largest = std::max(
          largest,
          logarithm(model.worldFromCamera(i) * views[i].world_from_camera.inverse()).norm());
    return largest;
  }

  double
  largestPointError() const
  {
    double largest = 0;
    for (const ScenePoint& point : model.points())
      if (!point.track.empty()) {
        const Observation& o = point.track.front();
        const int landmark = views[o.frame].landmarks[o.feature];
        largest = std::max(largest, (landmarks.point(landmark) - point.position).norm());
      }
    return largest;
  }
};

} // namespace

TEST(AdjustBundle, RecoversTheTruth)
{
  Scene scene;
  scene.perturb();
  ASSERT_GT(scene.largestPoseError(), 0.01);
  const BundleAdjustmentResult result = adjustBundle(scene.graph, scene.problem, {}, scene.model);
  EXPECT_TRUE(result.success);
  EXPECT_GT(result.iterations, 1);
  EXPECT_GT(result.num_residuals, 1000u);
  EXPECT_LT(result.final_cost, 1e-2);
  EXPECT_LT(scene.largestPoseError(), 1e-4);
  EXPECT_LT(scene.largestPointError(), 1e-4);
}

TEST(AdjustBundle, PixelsAloneKeepTheShape)
{
  Scene scene;
  scene.perturb();
  BundleAdjustmentOptions options;
  options.use_depth = false;
  const BundleAdjustmentResult with = adjustBundle(scene.graph, scene.problem, {}, scene.model);
  scene.perturb();
  const BundleAdjustmentResult without =
      adjustBundle(scene.graph, scene.problem, options, scene.model);
  EXPECT_TRUE(without.success);
  EXPECT_EQ(with.num_residuals, without.num_residuals / 2 * 3);
  EXPECT_LT(without.final_cost, 1e-2);
}

TEST(AdjustBundle, HoldsTheFirstImageWhichFixesTheGauge)
{
  Scene scene;
  scene.perturb();
  scene.problem.variable = {3, 0, 1, 2, 4, 5};
  std::vector<Eigen::Matrix4d> before;
  for (std::size_t i = 0; i < 6; ++i)
    before.push_back(scene.model.worldFromCamera(i).matrix());
  adjustBundle(scene.graph, scene.problem, {}, scene.model);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(scene.model.worldFromCamera(i).matrix() == before[i], i == 3) << i;
}

TEST(AdjustBundle, ConstantImagesStayBitEqual)
{
  Scene scene;
  scene.perturb();
  scene.problem.variable = {1, 2, 5};
  scene.problem.constant = {0, 3};
  std::vector<Eigen::Matrix4d> before;
  for (std::size_t i = 0; i < 6; ++i)
    before.push_back(scene.model.worldFromCamera(i).matrix());
  EXPECT_TRUE(adjustBundle(scene.graph, scene.problem, {}, scene.model).success);
  for (const std::size_t i : {0, 3, 4}) // 4 takes no part
    EXPECT_EQ(scene.model.worldFromCamera(i).matrix(), before[i]) << i;
  for (const std::size_t i : {1, 2, 5})
    EXPECT_NE(scene.model.worldFromCamera(i).matrix(), before[i]) << i;
}

TEST(AdjustBundle, CostNeverRisesAndTheOptimumStays)
{
  Scene scene;
  scene.perturb();
  double last = std::numeric_limits<double>::infinity();
  BundleAdjustmentOptions options;
  options.max_iterations = 1;
  for (int k = 0; k < 6; ++k) {
    const BundleAdjustmentResult result =
        adjustBundle(scene.graph, scene.problem, options, scene.model);
    EXPECT_LE(result.final_cost, result.initial_cost);
    EXPECT_LE(result.initial_cost, last * (1 + 1e-9) + 1e-9);
    last = result.final_cost;
  }
  Scene exact;
  adjustBundle(exact.graph, exact.problem, {}, exact.model);
  EXPECT_LT(exact.largestPoseError(), 1e-6);
}

namespace {

/** A scene whose pixels are off by half a pixel, some by more than can be true. */
struct NoisyScene : Scene {
  explicit NoisyScene(unsigned num_frames) : Scene(num_frames)
  {
    std::mt19937 random(3);
    std::normal_distribution<float> normal(0, 0.5f);
    for (LandmarkView& view : views)
      for (std::size_t j = 0; j < view.features.size(); ++j)
        view.features.pixels[j] +=
            (j % 20 == 0 ? 5.0f : 1.0f) * Eigen::Vector2f(normal(random), normal(random));
    graph = toGraph(landmarks, views);
    perturb();
  }
};

/** Adds each kind of term and unknown that an adjustment can have. */
void
complicate(NoisyScene& scene)
{
  scene.problem.depth_errors = true;
  scene.problem.calibrated = {CalibrationParameter::FOCAL_X, CalibrationParameter::DEPTH_BIAS};
  for (std::size_t i = 0; i + 2 < scene.views.size(); ++i) {
    RelativePoseTerm term{i, i + 2};
    term.first_from_second = randomMotion(i, 0.002, 0.002) *
                             scene.views[i].world_from_camera.inverse() *
                             scene.views[i + 2].world_from_camera;
    term.information = 1e5 * Matrix6d::Identity();
    scene.problem.relative_poses.push_back(term);
  }
}

const AdjustmentSolver SOLVERS[] = {AdjustmentSolver::SCHUR, AdjustmentSolver::CERES};

} // namespace

TEST(AdjustBundle, SolversReachTheSameCost)
{
  using Change = void (*)(NoisyScene&);
  const Change changes[] = {[](NoisyScene&) {},
                            [](NoisyScene& scene) { scene.problem.depth_errors = true; },
                            [](NoisyScene& scene) {
                              scene.problem.constant = {0, 2};
                              scene.problem.variable = {1, 3, 4};
                            },
                            complicate};
  for (const unsigned num_frames : {6, 70}) // dense and sparse factorisations of Ceres
    for (const Change change : changes) {
      if (num_frames > 6 && change != changes[3])
        continue;
      BundleAdjustmentResult results[2];
      for (int k = 0; k < 2; ++k) {
        NoisyScene scene(num_frames);
        change(scene);
        BundleAdjustmentOptions options;
        options.solver = SOLVERS[k];
        options.function_tolerance = 1e-12;
        options.max_iterations = 100;
        results[k] = adjustBundle(scene.graph, scene.problem, options, scene.model);
        EXPECT_TRUE(results[k].success);
      }
      const BundleAdjustmentResult &own = results[0], &ceres = results[1];
      EXPECT_EQ(own.num_residuals, ceres.num_residuals);
      EXPECT_NEAR(own.initial_cost, ceres.initial_cost, 1e-9 * ceres.initial_cost);
      EXPECT_GT(own.initial_cost, 2 * own.final_cost);
      EXPECT_NEAR(own.final_cost, ceres.final_cost, 1e-6 * ceres.final_cost) << num_frames;
    }
}

TEST(AdjustBundle, DoesNotDependOnThreads)
{
  const auto adjusted = [](AdjustmentSolver solver, int num_threads) {
    NoisyScene scene(30);
    complicate(scene);
    BundleAdjustmentOptions options;
    options.solver = solver;
    options.num_threads = num_threads;
    EXPECT_TRUE(adjustBundle(scene.graph, scene.problem, options, scene.model).success);
    return scene.model;
  };
  for (const AdjustmentSolver solver : SOLVERS) {
    const SparseModel one = adjusted(solver, 1);
    for (const int num_threads : {2, 3}) {
      const SparseModel other = adjusted(solver, num_threads);
      EXPECT_EQ(one.calibration().values, other.calibration().values);
      for (std::size_t i = 0; i < one.numFrames(); ++i) {
        EXPECT_EQ(one.worldFromCamera(i).matrix(), other.worldFromCamera(i).matrix());
        EXPECT_EQ(one.depthError(i), other.depthError(i));
      }
      for (std::size_t p = 0; p < one.points().size(); ++p)
        EXPECT_EQ(one.points()[p].position, other.points()[p].position);
    }
  }
}

TEST(AdjustBundle, IsTheSameFromRunToRun)
{
  Scene a, b;
  a.perturb();
  b.perturb();
  adjustBundle(a.graph, a.problem, {}, a.model);
  adjustBundle(b.graph, b.problem, {}, b.model);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(a.model.worldFromCamera(i).matrix(), b.model.worldFromCamera(i).matrix());
}

TEST(AdjustBundle, RelativePosesAlonePullPoses)
{
  Scene scene;
  SparseModel model(6);
  for (std::size_t i = 0; i < 6; ++i)
    model.registerFrame(i, scene.views[i].world_from_camera, 0); // no tracks
  model.setWorldFromCamera(1, randomMotion(1, 0.05, 0.1) * scene.views[1].world_from_camera);
  model.setWorldFromCamera(2, randomMotion(2, 0.05, 0.1) * scene.views[2].world_from_camera);
  BundleAdjustmentProblem problem;
  problem.variable = {0, 1, 2};
  for (std::size_t i = 0; i < 2; ++i) {
    RelativePoseTerm term;
    term.first = i;
    term.second = i + 1;
    term.first_from_second =
        scene.views[i].world_from_camera.inverse() * scene.views[i + 1].world_from_camera;
    term.information = 1e4 * Matrix6d::Identity();
    problem.relative_poses.push_back(term);
  }
  RelativePoseTerm ignored; // to a frame that takes no part
  ignored.first = 0;
  ignored.second = 5;
  ignored.information = 1e9 * Matrix6d::Identity();
  problem.relative_poses.push_back(ignored);
  const BundleAdjustmentResult result = adjustBundle(scene.graph, problem, {}, model);
  EXPECT_EQ(result.num_residuals, 12u);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT(
        logarithm(model.worldFromCamera(i) * scene.views[i].world_from_camera.inverse()).norm(),
        1e-4);
}

TEST(AdjustBundle, RefusesImagesWithoutAPose)
{
  Scene scene;
  scene.model.registerFrame(4, Pose::Identity(), -1);
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { adjustBundle(scene.graph, scene.problem, {}, scene.model); }),
                  "adjustBundle: frame 4 is not registered");
  scene.problem.variable = {0, 1};
  scene.problem.constant = {4};
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { adjustBundle(scene.graph, scene.problem, {}, scene.model); }),
                  "image 4 is not registered");
}

TEST(AdjustBundle, NothingToMoveMovesNothing)
{
  Scene scene;
  for (const std::vector<std::size_t>& variable :
       {std::vector<std::size_t>{}, std::vector<std::size_t>{2}, std::vector<std::size_t>{2, 2}}) {
    scene.problem.variable = variable;
    const Pose before = scene.model.worldFromCamera(2);
    EXPECT_TRUE(adjustBundle(scene.graph, scene.problem, {}, scene.model).success);
    EXPECT_EQ(scene.model.worldFromCamera(2).matrix(), before.matrix());
  }
}

TEST(CalibrationDeviations, AreFiniteBesideAnImageThatSeesNothing)
{
  Scene scene;
  scene.problem.calibrated = {CalibrationParameter::FOCAL_X, CalibrationParameter::FOCAL_X};
  scene.problem.variable = {0, 1, 2, 3};
  BundleAdjustmentProblem with_blind = scene.problem;
  SparseModel model(7);
  std::vector<LandmarkView> views = scene.views;
  views.push_back({});
  views.back().features = noFeatures();
  const ImageGraph graph = toGraph(scene.landmarks, views);
  for (std::size_t i = 0; i < 6; ++i)
    model.registerFrame(graph, i, views[i].world_from_camera, 0, {});
  model.registerFrame(graph, 6, Pose::Identity(), 0, {});
  with_blind.variable.push_back(6);
  const double without = calibrationDeviations(scene.graph, scene.problem, {}, scene.model)[0];
  EXPECT_GT(without, 0);
  EXPECT_NEAR(calibrationDeviations(graph, with_blind, {}, model)[0], without, 1e-6 * without);
}

TEST(AdjustBundle, RefusesInvalidOptions)
{
  Scene scene;
  const auto message = [&](const BundleAdjustmentOptions& options) {
    return messageOf<pcl::BadArgumentException>(
        [&] { adjustBundle(scene.graph, scene.problem, options, scene.model); });
  };
  BundleAdjustmentOptions options;
  options.max_iterations = 0;
  EXPECT_CONTAINS(message(options), "adjustBundle: max_iterations must be >= 1");
  options = {};
  options.loss_scale = 0;
  EXPECT_CONTAINS(message(options), "loss_scale must be > 0");
  options = {};
  options.function_tolerance = 0;
  EXPECT_CONTAINS(message(options), "function_tolerance must be > 0");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
  options = {};
  options.depth_error_deviation = 0;
  EXPECT_CONTAINS(message(options), "depth_error_deviation must be > 0");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [&] { heldBackCost(scene.graph, scene.problem, options, scene.model); }),
                  "heldBackCost: depth_error_deviation");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] {
                    calibrationDeviations(scene.graph, scene.problem, options, scene.model);
                  }),
                  "calibrationDeviations: depth_error_deviation");
}

TEST(HeldBack, IsAFifthOfLongTracks)
{
  int held = 0, all = 0;
  for (std::size_t length = 1; length < 12; ++length)
    for (int feature = 0; feature < 10; ++feature) {
      ScenePoint point;
      for (std::size_t k = 0; k < length; ++k)
        point.track.push_back({k, k == 0 ? feature : 3});
      for (std::size_t k = 0; k < length; ++k)
        if (length < 4) {
          EXPECT_FALSE(isHeldBack(point, k));
        }
        else {
          held += isHeldBack(point, k);
          ++all;
        }
    }
  EXPECT_EQ(5 * held, all);
}

TEST(HeldBack, ObservationsTakeNoPart)
{
  Scene scene;
  std::size_t held = 0, all = 0;
  for (const ScenePoint& point : scene.model.points())
    for (std::size_t k = 0; k < point.track.size(); ++k) {
      held += isHeldBack(point, k);
      ++all;
    }
  ASSERT_GT(held, 50u);
  EXPECT_EQ(adjustBundle(scene.graph, scene.problem, {}, scene.model).num_residuals, 3 * all);
  scene.problem.hold_back = true;
  EXPECT_EQ(adjustBundle(scene.graph, scene.problem, {}, scene.model).num_residuals,
            3 * (all - held));
}

TEST(HeldBack, CostIsThatOfEachVariableImage)
{
  Scene scene;
  scene.problem.hold_back = true;
  scene.problem.variable = {4, 1, 2};
  scene.problem.constant = {0, 3, 5};
  const BundleAdjustmentOptions options;
  const auto cost = [&] { return heldBackCost(scene.graph, scene.problem, options, scene.model); };
  ASSERT_EQ(cost().size(), 3u);
  for (const double exact : cost())
    EXPECT_LT(exact, 1e-2);
  scene.model.setWorldFromCamera(1, randomMotion(1, 0.01, 0.01) * scene.model.worldFromCamera(1));
  EXPECT_LT(cost()[0], 1e-2);
  EXPECT_GT(cost()[1], 1);
  EXPECT_LT(cost()[2], 1e-2);
}

TEST(HeldBack, CostOfOneObservationByHand)
{
  Scene scene;
  scene.problem.hold_back = true;
  const std::vector<double> before = heldBackCost(scene.graph, scene.problem, {}, scene.model);
  // Depth errors of three sigma in frame 2 alone
  scene.model.setDepthError(2, {3, 0, 0});
  std::size_t held = 0;
  for (const ScenePoint& point : scene.model.points())
    for (std::size_t k = 0; k < point.track.size(); ++k)
      held += point.track[k].frame == 2 && isHeldBack(point, k);
  ASSERT_GT(held, 5u);
  const std::vector<double> after = heldBackCost(scene.graph, scene.problem, {}, scene.model);
  const double robust = 4 * std::log1p(9.0 / 4); // Cauchy at a scale of 2
  EXPECT_NEAR(after[2] - before[2], robust * double(held), 1e-2 * double(held));
  EXPECT_EQ(after[1], before[1]);
}

TEST(CalibrationDeviations, AreThePriorWhereNothingIsSeen)
{
  Scene scene;
  EXPECT_EQ(calibrationDeviations(scene.graph, scene.problem, {}, scene.model),
            CalibrationVector(CalibrationVector::Zero()));
  // No frame moves: nothing tells when its rows and its depth were taken.
  using P = CalibrationParameter;
  scene.problem.calibrated = {P::TIME_OFFSET, P::READOUT, P::FOCAL_X};
  const CalibrationVector deviations =
      calibrationDeviations(scene.graph, scene.problem, {}, scene.model);
  for (const P parameter : {P::TIME_OFFSET, P::READOUT})
    EXPECT_NEAR(deviations[int(parameter)], calibrationPrior()[int(parameter)], 1e-9);
  EXPECT_GT(deviations[int(P::FOCAL_X)], 0);
  EXPECT_LT(deviations[int(P::FOCAL_X)], 0.5 * calibrationPrior()[int(P::FOCAL_X)]);
  EXPECT_EQ(deviations[int(P::FOCAL_Y)], 0);
}

TEST(AdjustBundle, DoesNotDependOnTheWorldFrame)
{
  Scene here, there;
  here.perturb();
  there.perturb();
  const Pose there_from_here = randomMotion(17, 1.2, 3);
  there.model.transform(0, there_from_here);
  adjustBundle(here.graph, here.problem, {}, here.model);
  adjustBundle(there.graph, there.problem, {}, there.model);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(logarithm(there_from_here * here.model.worldFromCamera(i) *
                        there.model.worldFromCamera(i).inverse())
                  .norm(),
              1e-5)
        << i;
}
