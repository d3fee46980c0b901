// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/held_back.h"
#include "faulty_scan.h"
#include "messages.h"

#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using P = CalibrationParameter;
using Parameters = std::vector<P>;

struct Fault {
  P parameter;
  double value;
};

/** Records with these faults (ascending), and expects that they and no others are
 * found, as exactly as is reported; and that three quarters of each fault go. */
void
expectFound(const std::vector<Fault>& faults)
{
  FaultyCamera camera;
  Parameters parameters;
  for (const Fault& fault : faults) {
    camera.faults[fault.parameter] = fault.value;
    parameters.push_back(fault.parameter);
  }
  FaultyScan scan(camera);
  const SelfCalibrationResult result = scan.calibrate();
  Parameters found = result.calibrated;
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, parameters) << report(result);
  EXPECT_FALSE(result.depth_errors) << report(result);
  scan.adjust(result);
  const CalibrationVector deviations =
      calibrationDeviations(scan.graph, scan.problem(result), {}, scan.model);
  for (const Fault& fault : faults) {
    const double value = scan.model.calibration()[fault.parameter];
    const double deviation = deviations[int(fault.parameter)];
    const char* name = calibrationName(fault.parameter);
    EXPECT_GT(deviation, 0) << name;
    EXPECT_LT(std::abs(value - fault.value), 4 * deviation) << name << " " << value;
    EXPECT_NEAR(value, fault.value, std::abs(fault.value) / 4) << name;
  }
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i)
    if (std::find(parameters.begin(), parameters.end(), P(i)) == parameters.end()) {
      EXPECT_EQ(scan.model.calibration().values[i], 0) << calibrationName(P(i));
      EXPECT_EQ(deviations[i], 0) << calibrationName(P(i));
    }
}

void
expectNothingApplied(const SelfCalibrationResult& result, const SparseModel& model)
{
  EXPECT_EQ(result.tests.size(), 9u);
  for (const CalibrationTest& test : result.tests)
    EXPECT_FALSE(test.applied) << report(result);
  EXPECT_TRUE(result.calibrated.empty());
  EXPECT_FALSE(result.depth_errors);
  EXPECT_EQ(model.calibration().values, CalibrationVector(CalibrationVector::Zero()));
  for (std::size_t i = 0; i < model.numFrames(); ++i)
    EXPECT_EQ(model.depthError(i), DepthError(DepthError::Zero()));
}

} // namespace

TEST(SelfCalibrate, FindsFocalLengths)
{
  expectFound({{P::FOCAL_X, 0.03}, {P::FOCAL_Y, 0.025}});
}

TEST(SelfCalibrate, FindsThePrincipalPoint)
{
  expectFound({{P::CENTER_X, 4}, {P::CENTER_Y, -3}});
}

TEST(SelfCalibrate, FindsRadialDistortion)
{
  expectFound({{P::RADIAL_1, 0.1}, {P::RADIAL_2, -0.08}});
}

TEST(SelfCalibrate, FindsDepthBias)
{
  expectFound({{P::DEPTH_BIAS, 0.012}});
}

TEST(SelfCalibrate, FindsDepthTilt)
{
  expectFound({{P::DEPTH_TILT_X, 0.015}, {P::DEPTH_TILT_Y, -0.01}});
}

TEST(SelfCalibrate, FindsTheAlignmentOfDepthAndColour)
{
  expectFound({{P::DEPTH_SHIFT_X, 2}, {P::DEPTH_SHIFT_Y, -1.5}});
}

TEST(SelfCalibrate, FindsRollingShutter)
{
  expectFound({{P::READOUT, 0.02}});
}

TEST(SelfCalibrate, FindsTheTimeOffsetOfDepth)
{
  expectFound({{P::TIME_OFFSET, 0.02}});
}

TEST(SelfCalibrate, FindsSeveralAtOnce)
{
  expectFound(
      {{P::FOCAL_X, -0.015}, {P::FOCAL_Y, -0.015}, {P::READOUT, 0.025}, {P::TIME_OFFSET, -0.015}});
}

TEST(SelfCalibrate, FindsTheDepthErrorOfEachImage)
{
  FaultyCamera camera;
  camera.depth_error_sigmas = 1.5;
  FaultyScan scan(camera);
  const SelfCalibrationResult result = scan.calibrate();
  EXPECT_TRUE(result.depth_errors) << report(result);
  EXPECT_TRUE(result.calibrated.empty()) << report(result);
  scan.adjust(result);
  // What all frames have in common looks like another scale or depth bias.
  DepthError mean = DepthError::Zero();
  for (const std::size_t i : scan.frames)
    mean += (scan.model.depthError(i) - scan.views[i].depth_error) / 30.0;
  double squares = 0;
  for (const std::size_t i : scan.frames)
    squares += (scan.model.depthError(i) - scan.views[i].depth_error - mean).squaredNorm();
  EXPECT_LT(std::sqrt(squares / 90), camera.depth_error_sigmas / 4);
}

TEST(SelfCalibrate, RefusesCorrectionsOfACameraWithoutFaults)
{
  for (unsigned seed = 0; seed < 3; ++seed) {
    FaultyCamera camera;
    camera.seed = seed;
    FaultyScan scan(camera);
    const SelfCalibrationResult result = scan.calibrate();
    expectNothingApplied(result, scan.model);
    // Two numbers too many do not cost much either, when all is converged.
    for (const CalibrationTest& test : result.tests)
      if (!test.parameters.empty()) {
        EXPECT_GT(test.gain, -SelfCalibrationOptions().min_gain) << report(result);
      }
  }
}

TEST(SelfCalibrate, CannotSeeADepthScale)
{
  FaultyCamera camera;
  camera.depth_factor = 1.03;
  FaultyScan scan(camera);
  const SelfCalibrationResult result = scan.calibrate();
  expectNothingApplied(result, scan.model);
  scan.adjust(result);
  // The whole scan is as much larger.
  double product = 0, square = 0;
  const Eigen::Vector3d first = scan.model.worldFromCamera(0).translation();
  for (const std::size_t i : scan.frames) {
    const Eigen::Vector3d truth = scan.views[i].view.world_from_camera.translation() -
                                  scan.views[0].view.world_from_camera.translation();
    product += truth.norm() * (scan.model.worldFromCamera(i).translation() - first).norm();
    square += truth.squaredNorm();
  }
  EXPECT_NEAR(product / square, 1.03, 0.003); // a millimetre in 0.4 m
}

TEST(SelfCalibrate, DoesNotTestWithTooFewImages)
{
  FaultyCamera camera;
  camera.faults[P::FOCAL_X] = camera.faults[P::FOCAL_Y] = 0.03;
  FaultyScan scan(camera, 7);
  const SparseModel before = scan.model;
  const SelfCalibrationResult result = scan.calibrate();
  expectNothingApplied(result, scan.model);
  for (const CalibrationTest& test : result.tests)
    EXPECT_EQ(test.significance, 0) << test.name;
  for (const std::size_t i : scan.frames)
    EXPECT_EQ(scan.model.worldFromCamera(i).matrix(), before.worldFromCamera(i).matrix());
}

TEST(SelfCalibrate, StampsThatTellNothingGiveNoTimes)
{
  FaultyCamera camera;
  camera.faults[P::READOUT] = 0.02;
  camera.faults[P::TIME_OFFSET] = 0.02;
  FaultyScan scan(camera, 30, 5.0); // said to be five seconds apart
  const SelfCalibrationResult result = scan.calibrate();
  for (const P parameter : result.calibrated)
    EXPECT_TRUE(parameter != P::READOUT && parameter != P::TIME_OFFSET) << report(result);
  EXPECT_EQ(scan.model.calibration()[P::READOUT], 0);
  EXPECT_EQ(scan.model.calibration()[P::TIME_OFFSET], 0);
}

TEST(SelfCalibrate, DoesNotDependOnThreads)
{
  FaultyCamera camera;
  camera.faults[P::FOCAL_X] = camera.faults[P::FOCAL_Y] = 0.02;
  camera.faults[P::TIME_OFFSET] = 0.02;
  FaultyScan scans[]{FaultyScan(camera), FaultyScan(camera)};
  SelfCalibrationResult results[2];
  for (int k = 0; k < 2; ++k) {
    SelfCalibrationOptions options;
    options.num_threads = 1 + k;
    results[k] = scans[k].calibrate(options);
  }
  EXPECT_FALSE(results[0].calibrated.empty()) << report(results[0]);
  EXPECT_EQ(results[0].calibrated, results[1].calibrated);
  for (std::size_t t = 0; t < results[0].tests.size(); ++t) {
    EXPECT_EQ(results[0].tests[t].gain, results[1].tests[t].gain);
    EXPECT_EQ(results[0].tests[t].significance, results[1].tests[t].significance);
  }
  EXPECT_EQ(scans[0].model.calibration().values, scans[1].model.calibration().values);
  for (const std::size_t i : scans[0].frames)
    EXPECT_EQ(scans[0].model.worldFromCamera(i).matrix(),
              scans[1].model.worldFromCamera(i).matrix());
}

TEST(SelfCalibrate, RefusesInvalidOptions)
{
  const ImageGraph graph(landmarks().camera());
  const auto message = [&graph](const SelfCalibrationOptions& options) {
    SparseModel model;
    return messageOf<pcl::BadArgumentException>(
        [&] { selfCalibrate(graph, {}, {}, options, model); });
  };
  SelfCalibrationOptions options;
  options.max_frames = 1;
  EXPECT_CONTAINS(message(options), "selfCalibrate: max_frames and min_frames must be >= 2");
  options = {};
  options.min_frames = 1;
  EXPECT_CONTAINS(message(options), "max_frames and min_frames must be >= 2");
  options = {};
  options.min_track_length = 1;
  EXPECT_CONTAINS(message(options), "min_track_length must be >= 2");
  options = {};
  options.significance = 0;
  EXPECT_CONTAINS(message(options), "significance must be > 0");
  options = {};
  options.min_gain = -0.1;
  EXPECT_CONTAINS(message(options), "min_gain must be >= 0");
  options = {};
  options.max_iterations = 0;
  EXPECT_CONTAINS(message(options), "max_iterations must be >= 1");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(message(options), "num_threads must be >= 0");
}
