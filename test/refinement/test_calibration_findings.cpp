// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "faulty_scan.h"

#include "refinement/verification.h"

#include <algorithm>

using namespace bundle_icp;
using namespace bundle_icp::test;

using P = CalibrationParameter;

TEST(SelfCalibrate, SaysButDoesNotApplyAFocalLengthThatNoErrorOfCalibrationExplains)
{
  FaultyCamera camera;
  camera.faults[P::FOCAL_X] = camera.faults[P::FOCAL_Y] = 0.1;
  FaultyScan scan(camera);
  const SelfCalibrationResult result = scan.calibrate();
  EXPECT_EQ(scan.model.calibration()[P::FOCAL_X], 0) << report(result);
  const CalibrationTest& focal = result.tests[3];
  ASSERT_EQ(focal.name, "focal length");
  EXPECT_FALSE(focal.applied);
  ASSERT_EQ(focal.implausible.size(), 2u) << report(result);
  EXPECT_NEAR(focal.implausible[0], 0.1, 0.03);
  const std::vector<Finding> findings =
      calibrationFindings(result, scan.model.calibration(), scan.graph.camera());
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].kind, "focal_length");
  EXPECT_EQ(findings[0].severity, Severity::FAULT);
  EXPECT_NEAR(findings[0].evidence[2].second, 1.1 * scan.graph.camera().fx, 10);
}

TEST(SelfCalibrate, SaysAWrongFocalLengthBehindAWrongLens)
{
  for (const double error : {-0.07, 0.07}) {
    FaultyCamera camera;
    camera.faults[P::FOCAL_X] = camera.faults[P::FOCAL_Y] = error;
    camera.faults[P::CENTER_Y] = 16;
    camera.faults[P::RADIAL_1] = 0.15;
    camera.faults[P::RADIAL_2] = -0.25;
    camera.faults[P::READOUT] = 0.024;
    camera.depth_error_sigmas = 1;
    FaultyScan scan(camera);
    const SelfCalibrationResult result = scan.calibrate();
    const std::vector<Finding> findings =
        calibrationFindings(result, scan.model.calibration(), scan.graph.camera());
    const auto found = std::find_if(findings.begin(), findings.end(), [](const Finding& finding) {
      return finding.kind == "focal_length";
    });
    ASSERT_NE(found, findings.end()) << error << "\n" << report(result);
    EXPECT_EQ(found->severity, Severity::FAULT) << found->what;
    EXPECT_NEAR(found->evidence[2].second, (1 + error) * scan.graph.camera().fx, 15);
  }
}

TEST(SelfCalibrate, MeasuresWhatTheFocalLengthWantsToBe)
{
  for (const double error : {0.0, -0.03}) {
    FaultyCamera camera;
    camera.faults[P::FOCAL_X] = camera.faults[P::FOCAL_Y] = error;
    FaultyScan scan(camera);
    const SelfCalibrationResult result = scan.calibrate();
    const WantedFocalLength& wanted = result.wanted_focal;
    EXPECT_GT(wanted.deviation, 0);
    EXPECT_LT(wanted.deviation, 0.01);
    EXPECT_NEAR(wanted.mean(), error, 0.01);
    EXPECT_TRUE(calibrationFindings(result, scan.model.calibration(), scan.graph.camera()).empty())
        << error;
  }
}

TEST(SelfCalibrate, DoesNotMakePixelsOblong)
{
  FaultyCamera camera;
  camera.faults[P::FOCAL_X] = 0.04;
  FaultyScan scan(camera);
  const SelfCalibrationResult result = scan.calibrate();
  EXPECT_EQ(scan.model.calibration()[P::FOCAL_X], 0) << report(result);
  const std::vector<Finding> findings =
      calibrationFindings(result, scan.model.calibration(), scan.graph.camera());
  ASSERT_EQ(findings.size(), 1u) << report(result);
  EXPECT_EQ(findings[0].severity, Severity::FAULT);
  EXPECT_NE(findings[0].what.find("not square"), std::string::npos) << findings[0].what;
}

TEST(CalibrationFindings, OfAWantedFocalLength)
{
  const CameraIntrinsics& camera = landmarks().camera();
  const auto severity = [&](double wanted, double deviation, bool is_corrected) {
    SelfCalibrationResult result;
    result.wanted_focal = {wanted, wanted, deviation};
    if (is_corrected)
      result.calibrated = {P::FOCAL_X, P::FOCAL_Y};
    const std::vector<Finding> findings = calibrationFindings(result, {}, camera);
    return findings.empty() ? Severity::NOTE : findings[0].severity;
  };
  EXPECT_EQ(severity(-0.055, 0.0015, false), Severity::FAULT);
  EXPECT_EQ(severity(0.055, 0.0015, true), Severity::FAULT);
  EXPECT_EQ(severity(0.045, 0.005, false), Severity::FAULT); // 5 % is not excluded
  EXPECT_EQ(severity(0.045, 0.001, false), Severity::WARNING);
  EXPECT_EQ(severity(0.045, 0.001, true), Severity::NOTE); // it was corrected
  EXPECT_EQ(severity(0.016, 0.002, false), Severity::NOTE);
  EXPECT_EQ(severity(0.06, 0.015, false), Severity::WARNING);
  EXPECT_EQ(severity(0.06, 0.04, false), Severity::NOTE); // the scan does not determine it
  EXPECT_EQ(severity(0.06, 0, false), Severity::NOTE);    // not measured
}
