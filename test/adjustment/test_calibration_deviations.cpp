// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/held_back.h"
#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST(CalibrationDeviations, AreFiniteBesideAnImageThatSeesNothing)
{
  LandmarkScene scene;
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

TEST(CalibrationDeviations, AreThePriorWhereNothingIsSeen)
{
  LandmarkScene scene;
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

namespace {

/** Deviation of the focal length, by the whole scene or by some of its frames. */
double
focalDeviation(const std::vector<std::size_t>& frames, float sigma_factor = 1)
{
  LandmarkScene scene;
  std::vector<LandmarkView> views = scene.views;
  for (LandmarkView& view : views)
    for (std::size_t j = 0; j < view.features.size(); ++j) {
      view.features.pixel_sigmas[j] *= sigma_factor;
      view.features.depth_sigmas[j] *= sigma_factor;
    }
  scene.problem.variable = frames;
  scene.problem.calibrated = {CalibrationParameter::FOCAL_X};
  return calibrationDeviations(toGraph(scene.landmarks, views), scene.problem, {}, scene.model)[0];
}

double
information(double deviation)
{
  return 1 / (deviation * deviation);
}

} // namespace

TEST(CalibrationDeviations, ScaleWithTheSigmasOfFeatures)
{
  const std::vector<std::size_t> all{0, 1, 2, 3, 4, 5};
  const double prior = information(calibrationPrior()[0]);
  const double once = information(focalDeviation(all)) - prior;
  for (const float factor : {0.5f, 3.0f})
    EXPECT_NEAR((information(focalDeviation(all, factor)) - prior) * factor * factor / once, 1,
                1e-3);
}

TEST(CalibrationDeviations, FallWithEachImage)
{
  double last = calibrationPrior()[0];
  for (const std::vector<std::size_t>& frames :
       {std::vector<std::size_t>{0, 1}, {0, 1, 2, 3}, {0, 1, 2, 3, 4, 5}}) {
    const double deviation = focalDeviation(frames);
    EXPECT_LT(deviation, last);
    last = deviation;
  }
}

TEST(CalibrationDeviations, GrowWithWhatElseIsUnknown)
{
  using P = CalibrationParameter;
  LandmarkScene scene;
  const auto deviations = [&] {
    return calibrationDeviations(scene.graph, scene.problem, {}, scene.model);
  };
  scene.problem.calibrated = {P::DEPTH_BIAS};
  const double alone = deviations()[int(P::DEPTH_BIAS)];
  scene.problem.calibrated = {P::FOCAL_X, P::FOCAL_Y, P::DEPTH_BIAS};
  const double beside = deviations()[int(P::DEPTH_BIAS)];
  EXPECT_GT(beside, alone);
  scene.problem.depth_errors = true;
  EXPECT_GT(deviations()[int(P::DEPTH_BIAS)], beside);
}
