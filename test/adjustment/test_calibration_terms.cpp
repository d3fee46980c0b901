// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/held_back.h"
#include "adjustment/landmark_scene.h"

#include <gtest/gtest.h>

#include <functional>

using namespace bundle_icp;
using namespace bundle_icp::test;
using P = CalibrationParameter;

namespace {

/** A scene of a camera that differs from what its features were taken with: tracks are exact. */
struct FaultyScene : LandmarkScene {
  ImageGraph faulty;
  BundleAdjustmentOptions options;

  explicit FaultyScene(const std::function<void(CameraIntrinsics&, Features&)>& fault)
  : faulty(faultyGraph(fault))
  {
    options.max_iterations = 100;
    options.function_tolerance = 1e-12;
  }

  CalibrationVector
  adjust()
  {
    EXPECT_TRUE(adjustBundle(faulty, problem, options, model).success);
    return model.calibration().values;
  }

  /** What an adjustment is to find: the true value, less the share by which the prior pulls it
   *  to zero, which is that of the variances. */
  double
  expected(P parameter, double truth) const
  {
    const CalibrationVector deviations = calibrationDeviations(faulty, problem, options, model);
    const double share = deviations[int(parameter)] / calibrationPrior()[int(parameter)];
    EXPECT_LT(share, 0.5);
    return truth * (1 - share * share);
  }

private:
  ImageGraph
  faultyGraph(const std::function<void(CameraIntrinsics&, Features&)>& fault) const
  {
    CameraIntrinsics camera = landmarks.camera();
    std::vector<ImageNode> nodes = toNodes(views);
    for (ImageNode& node : nodes) {
      camera = landmarks.camera();
      fault(camera, node.features);
    }
    ImageGraph result(camera);
    result.append(std::move(nodes), true);
    return result;
  }
};

/** Expects that of all parameters only one is not zero. */
void
expectOnly(const CalibrationVector& found, P parameter, double value, double tolerance)
{
  for (int k = 0; k < NUM_CALIBRATION_PARAMETERS; ++k)
    EXPECT_NEAR(found[k], k == int(parameter) ? value : 0, k == int(parameter) ? tolerance : 0)
        << calibrationName(P(k));
}

} // namespace

TEST(CalibrationTerms, FindTheTrueFocalLength)
{
  for (const bool use_depth : {true, false}) {
    FaultyScene scene([](CameraIntrinsics& camera, Features&) { camera.fx /= 1.01; });
    scene.problem.calibrated = {P::FOCAL_X};
    scene.options.use_depth = use_depth;
    const CalibrationVector found = scene.adjust();
    expectOnly(found, P::FOCAL_X, scene.expected(P::FOCAL_X, 0.01), 5e-5);
  }
}

TEST(CalibrationTerms, FindTheTrueCentre)
{
  FaultyScene scene([](CameraIntrinsics& camera, Features&) { camera.cy -= 2; });
  scene.problem.calibrated = {P::CENTER_Y};
  const CalibrationVector found = scene.adjust();
  expectOnly(found, P::CENTER_Y, scene.expected(P::CENTER_Y, 2), 0.01);
}

TEST(CalibrationTerms, FindABiasOfDepthThatPixelsCannotShow)
{
  FaultyScene scene([](CameraIntrinsics&, Features& features) {
    for (float& z : features.depths)
      z *= 1 + 0.01f * z;
  });
  scene.problem.calibrated = {P::DEPTH_BIAS};
  const CalibrationVector found = scene.adjust();
  expectOnly(found, P::DEPTH_BIAS, scene.expected(P::DEPTH_BIAS, 0.01), 1e-4);
  scene.model.setCalibration({});
  scene.options.use_depth = false;
  expectOnly(scene.adjust(), P::DEPTH_BIAS, 0, 1e-12);
}

TEST(CalibrationTerms, SolversAndTheOrderOfParametersAgree)
{
  CalibrationVector found[2];
  const std::vector<P> orders[] = {{P::FOCAL_X, P::CENTER_X, P::DEPTH_BIAS},
                                   {P::DEPTH_BIAS, P::FOCAL_X, P::CENTER_X, P::FOCAL_X}};
  for (int k = 0; k < 2; ++k) {
    FaultyScene scene([](CameraIntrinsics& camera, Features& features) {
      camera.fx /= 1.01;
      camera.cx += 1;
      for (float& z : features.depths)
        z *= 1 - 0.005f * z;
    });
    scene.problem.calibrated = orders[k];
    scene.options.solver = k == 0 ? AdjustmentSolver::SCHUR : AdjustmentSolver::CERES;
    found[k] = scene.adjust();
  }
  EXPECT_LT((found[0] - found[1]).cwiseQuotient(calibrationPrior()).norm(), 1e-3);
  EXPECT_NEAR(found[0][int(P::FOCAL_X)], 0.01, 1e-3);
  EXPECT_NEAR(found[0][int(P::CENTER_X)], -1, 0.1);
}

TEST(CalibrationTerms, ReturnToZeroWhereNothingHoldsThem)
{
  // No frame moves: nothing shows when its rows and its depth were taken.
  FaultyScene scene([](CameraIntrinsics&, Features&) {});
  Calibration calibration;
  calibration[P::TIME_OFFSET] = 0.02;
  calibration[P::READOUT] = 0.01;
  scene.model.setCalibration(calibration);
  scene.problem.calibrated = {P::TIME_OFFSET};
  const CalibrationVector found = scene.adjust();
  EXPECT_NEAR(found[int(P::TIME_OFFSET)], 0, 1e-6);
  EXPECT_EQ(found[int(P::READOUT)], 0.01); // not adjusted
}

TEST(CalibrationTerms, DepthErrorsAreSharedBetweenPriorAndMeasurements)
{
  const DepthError error(2, 0, 0);
  LandmarkScene scene;
  std::vector<LandmarkView> views = scene.views;
  for (float& z : views[2].features.depths)
    z += float(error[0] * DepthNoise().sigma(z));
  const ImageGraph graph = toGraph(scene.landmarks, views);
  scene.problem.depth_errors = true;
  const auto found = [&](double deviation) {
    BundleAdjustmentOptions options;
    options.depth_error_deviation = deviation;
    options.max_iterations = 100;
    options.function_tolerance = 1e-12;
    EXPECT_TRUE(adjustBundle(graph, scene.problem, options, scene.model).success);
    return scene.model.depthError(2)[0];
  };
  const double loose = found(100), usual = found(2), tight = found(0.05);
  EXPECT_NEAR(loose, error[0], 0.1);
  EXPECT_LT(usual, loose);
  EXPECT_GT(usual, 0.6 * loose);
  EXPECT_LT(tight, 0.5 * loose);
  EXPECT_GT(tight, 0);
}
