// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "model/measurement_model.h"

#include "registration/scenes.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using P = CalibrationParameter;

/** Model with a single correction, of a camera with focal length 100 px and its centre
 * at (79.5, 59.5), 120 rows high. */
struct Single {
  CameraIntrinsics camera = smallCamera(160, 120, 100);
  CalibrationVector values = CalibrationVector::Zero();
  Vector6d motion = Vector6d::Zero();

  Single() = default;

  Single(P parameter, double value) { values[int(parameter)] = value; }

  MeasurementModel
  model() const
  {
    return {camera, values, motion};
  }

  Eigen::Vector2d
  pixel(const Eigen::Vector3d& point, double row = 59.5) const
  {
    return model().pixel(point, row);
  }

  double
  depth(const Eigen::Vector3d& point, const DepthError& error = DepthError::Zero()) const
  {
    return model().depth(point, camera.project(point), error, DepthNoise());
  }
};

void
expectPixel(const Eigen::Vector2d& pixel, double u, double v)
{
  EXPECT_NEAR(pixel.x(), u, 1e-9);
  EXPECT_NEAR(pixel.y(), v, 1e-9);
}

const Eigen::Vector3d POINT(1, 0.5, 2); ///< seen along the ray (0.5, 0.25, 1)

} // namespace

TEST(MeasurementModel, WithoutCorrectionsIsThePinhole)
{
  expectPixel(Single().pixel(POINT), 79.5 + 50, 59.5 + 25);
  EXPECT_DOUBLE_EQ(Single().depth(POINT), 2);
}

TEST(MeasurementModel, CorrectsFocalLengthsAndCentre)
{
  expectPixel(Single(P::FOCAL_X, 0.02).pixel(POINT), 79.5 + 51, 59.5 + 25);
  expectPixel(Single(P::FOCAL_Y, -0.04).pixel(POINT), 79.5 + 50, 59.5 + 24);
  expectPixel(Single(P::CENTER_X, 3).pixel(POINT), 82.5 + 50, 59.5 + 25);
  expectPixel(Single(P::CENTER_Y, -2).pixel(POINT), 79.5 + 50, 57.5 + 25);
}

TEST(MeasurementModel, DistortsRadially)
{
  const double r2 = 0.25 + 0.0625;
  const double once = 1 + 0.1 * r2, twice = 1 + 0.1 * r2 * r2;
  expectPixel(Single(P::RADIAL_1, 0.1).pixel(POINT), 79.5 + 50 * once, 59.5 + 25 * once);
  expectPixel(Single(P::RADIAL_2, 0.1).pixel(POINT), 79.5 + 50 * twice, 59.5 + 25 * twice);
}

TEST(MeasurementModel, ReadoutShiftsByMotionTimesTime)
{
  Single rolling(P::READOUT, 0.04);
  rolling.motion << 0, 0, 0, 0.5, 0, 0; // the scene moves to the right, 0.5 m/s
  // The last row is exposed (119.5 / 120 - 0.5) 40 ms after the middle.
  const double time = (119.5 / 120 - 0.5) * 0.04;
  const double shift = 100 * 0.5 * time / 2; // [px], at 2 m
  expectPixel(rolling.pixel(POINT, 119), 129.5 + shift, 84.5);
  expectPixel(rolling.pixel(POINT, 59.5), 129.5, 84.5);
  expectPixel(rolling.pixel(POINT, 0), 129.5 - shift, 84.5);
}

TEST(MeasurementModel, ReadoutFollowsARotation)
{
  Single rolling(P::READOUT, 0.03);
  rolling.motion << 0.2, -1.5, 0.7, 0.3, 0.1, -0.4; // 95 degrees a second
  for (const double row : {0.0, 30.0, 119.0}) {
    const double time = ((row + 0.5) / 120 - 0.5) * 0.03;
    const Eigen::Vector3d moved = increment(time * rolling.motion) * POINT;
    // To second order in time: 0.025 rad to the third power over six, times the focal
    // length
    EXPECT_LT((rolling.pixel(POINT, row) - rolling.camera.project(moved)).norm(), 1e-3);
  }
}

TEST(MeasurementModel, AStaticCameraDoesNotDependOnRow)
{
  const Single rolling(P::READOUT, 0.04);
  for (const double row : {0.0, 60.0, 119.0})
    EXPECT_EQ(rolling.pixel(POINT, row), rolling.pixel(POINT, 59.5));
  Single at_once; // and no readout time does not depend on motion
  at_once.motion << 1, -1, 0.5, 0.3, 0.2, 0.1;
  for (const double row : {0.0, 60.0, 119.0})
    EXPECT_EQ(at_once.pixel(POINT, row), Single().pixel(POINT));
}

TEST(MeasurementModel, DepthErrorsByHand)
{
  EXPECT_NEAR(Single(P::DEPTH_BIAS, 0.01).depth(POINT), 2 * (1 + 0.01 * 2), 1e-12);
  EXPECT_NEAR(Single(P::DEPTH_TILT_X, 0.02).depth(POINT), 2 * (1 + 0.02 * 0.5), 1e-12);
  EXPECT_NEAR(Single(P::DEPTH_TILT_Y, 0.02).depth(POINT), 2 * (1 + 0.02 * 0.25), 1e-12);
  const double sigma = DepthNoise().sigma(2);
  EXPECT_NEAR(Single().depth(POINT, {3, 0, 0}), 2 + 3 * sigma, 1e-12);
  EXPECT_NEAR(Single().depth(POINT, {0, 3, 0}), 2 + 1.5 * sigma, 1e-12);
  EXPECT_NEAR(Single().depth(POINT, {0, 0, 3}), 2 + 0.75 * sigma, 1e-12);
}

TEST(MeasurementModel, LateDepthIsThatOfAPointThatMovedOn)
{
  Single late(P::TIME_OFFSET, 0.02);
  EXPECT_DOUBLE_EQ(late.depth(POINT), 2);
  late.motion << 0, 0, 0, 0, 0, -0.5; // the scene comes nearer
  EXPECT_NEAR(late.depth(POINT), 2 - 0.01, 1e-12);
}

TEST(MeasurementModel, UnprojectInvertsPixel)
{
  Single camera;
  camera.values << 0.02, -0.03, 4, -3, 0.05, -0.02, 0.01, 0.02, -0.03, 1, -2, 0.03, 0.02;
  camera.motion << 0.3, -0.4, 0.2, 0.2, -0.1, 0.3;
  const MeasurementModel model = camera.model();
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(79, 60), Eigen::Vector2d(5, 10), Eigen::Vector2d(150, 115)}) {
    const Eigen::Vector3d point = model.unproject(pixel, 1.7);
    // Both are of second order in time, 0.008 rad to the third power, and undo four
    // rounds of the distortion: a hundredth of any feature's accuracy is enough.
    EXPECT_LT((model.pixel(point, pixel.y()) - pixel).norm(), 5e-3) << pixel.transpose();
    const Vector6d until_row = 0.03 * ((pixel.y() + 0.5) / 120 - 0.5) * camera.motion;
    EXPECT_NEAR((increment(until_row) * point).z(), 1.7, 1e-5);
  }
}

TEST(MeasurementModel, UnprojectIsExactForAStaticPinhole)
{
  const Eigen::Vector3d point = Single().model().unproject({129.5, 84.5}, 2);
  EXPECT_LT((point - POINT).norm(), 1e-12);
}
