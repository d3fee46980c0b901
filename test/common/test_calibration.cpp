// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/calibration.h>

#include <gtest/gtest.h>

#include <set>

using namespace bundle_icp;
using P = CalibrationParameter;

TEST(Calibration, EachParameterHasANameAndAUnit)
{
  std::set<std::string> names;
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i) {
    names.insert(calibrationName(P(i)));
    EXPECT_STRNE(calibrationUnit(P(i)), "");
  }
  EXPECT_EQ(names.size(), std::size_t(NUM_CALIBRATION_PARAMETERS));
  EXPECT_STREQ(calibrationUnit(P::CENTER_Y), "px");
  EXPECT_STREQ(calibrationUnit(P::TIME_OFFSET), "s");
}

TEST(Calibration, ScaledDepthIsCorrectedToScaledDepth)
{
  Calibration calibration;
  calibration[P::DEPTH_BIAS] = 0.02;
  calibration[P::DEPTH_TILT_X] = 0.05;
  const DepthNoise noise;
  const double before =
      correctedDepth(2.0, 0.3, -0.2, calibration, DepthError::Zero(), noise);
  Calibration scaled = calibration;
  scaled.scaleDepth(1.1);
  EXPECT_EQ(scaled.depth_scale, 1.1);
  EXPECT_EQ(scaled.depth_scale_origin, DepthScaleOrigin::KNOWN_DISTANCE);
  // The reader multiplies by depth_scale before.
  EXPECT_NEAR(correctedDepth(1.1 * 2.0, 0.3, -0.2, scaled, DepthError::Zero(), noise),
              1.1 * before, 1e-6);
}
