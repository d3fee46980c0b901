// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/calibration.h>

#include "messages.h"
#include "registration/scenes.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using P = CalibrationParameter;

const float HOLE = std::numeric_limits<float>::quiet_NaN();

/** The equation of the header. */
double
measuredDepth(double z, double x, double y, const Calibration& c, const DepthError& e)
{
  return z * (1 + c[P::DEPTH_BIAS] * z + c[P::DEPTH_TILT_X] * x + c[P::DEPTH_TILT_Y] * y) +
         DepthNoise().sigma(z) * (e[0] + e[1] * x + e[2] * y);
}

Calibration
someDepthFaults()
{
  Calibration calibration;
  calibration[P::DEPTH_BIAS] = 0.004;
  calibration[P::DEPTH_TILT_X] = -0.01;
  calibration[P::DEPTH_TILT_Y] = 0.015;
  return calibration;
}

/** Depth that tells where each of its pixels came from. */
cv::Mat
numberedDepth(const CameraIntrinsics& camera)
{
  cv::Mat depth(camera.height, camera.width, CV_32F);
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u)
      depth.at<float>(v, u) = 1 + 0.01f * float(u) + 0.0001f * float(v);
  return depth;
}

} // namespace

TEST(Calibration, HasANameForEachParameter)
{
  std::set<std::string> names;
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i)
    names.insert(calibrationName(P(i)));
  EXPECT_EQ(names.size(), std::size_t(NUM_CALIBRATION_PARAMETERS));
  EXPECT_STREQ(calibrationName(P::FOCAL_X), "focal_x");
  EXPECT_STREQ(calibrationName(P::DEPTH_BIAS), "depth_bias");
  EXPECT_STREQ(calibrationName(P::TIME_OFFSET), "time_offset");
}

TEST(Calibration, CorrectsFocalLengthsAndCentre)
{
  const CameraIntrinsics camera = smallCamera(160, 120, 100);
  Calibration calibration;
  calibration[P::FOCAL_X] = 0.02;
  calibration[P::FOCAL_Y] = -0.03;
  calibration[P::CENTER_X] = 2;
  calibration[P::CENTER_Y] = -4;
  const CameraIntrinsics corrected = calibration.corrected(camera);
  EXPECT_DOUBLE_EQ(corrected.fx, 102);
  EXPECT_DOUBLE_EQ(corrected.fy, 97);
  EXPECT_DOUBLE_EQ(corrected.cx, 81.5);
  EXPECT_DOUBLE_EQ(corrected.cy, 55.5);
  EXPECT_EQ(corrected.width, 160);
  EXPECT_EQ(corrected.height, 120);
}

TEST(Calibration, RefusesWhatIsAnotherCamera)
{
  EXPECT_TRUE(Calibration().isValid());
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i)
    for (const double value : {1e3, -1e3, std::numeric_limits<double>::quiet_NaN()}) {
      Calibration calibration;
      calibration.values[i] = value;
      std::string error;
      EXPECT_FALSE(calibration.isValid(&error));
      EXPECT_CONTAINS(error, std::string(calibrationName(P(i))) + " must lie within +-");
    }
  for (const double scale : {0.0, 0.5, 2.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Calibration calibration;
    calibration.depth_scale = scale;
    std::string error;
    EXPECT_FALSE(calibration.isValid(&error)) << scale;
    EXPECT_CONTAINS(error, "depth_scale must lie in (0.5, 2)");
  }
}

TEST(CorrectedDepth, InvertsTheEquation)
{
  const DepthError error(2, -1.5, 1);
  double largest_error = 0;
  for (const double z : {0.5, 1.5, 3.0, 5.0})
    for (const double x : {-0.6, 0.0, 0.5})
      for (const double y : {-0.4, 0.3}) {
        const double measured = measuredDepth(z, x, y, someDepthFaults(), error);
        largest_error = std::max(largest_error, std::abs(measured - z));
        EXPECT_NEAR(correctedDepth(measured, x, y, someDepthFaults(), error, DepthNoise()), z,
                    1e-4); // a tenth of the best depth noise
      }
  EXPECT_GT(largest_error, 0.1); // there was something to correct
}

TEST(CorrectedDepth, WithoutFaultsIsTheMeasuredOne)
{
  EXPECT_DOUBLE_EQ(correctedDepth(1.7, 0.3, -0.2, Calibration(), DepthError::Zero(), DepthNoise()),
                   1.7);
  const CameraIntrinsics camera = smallCamera(40, 30, 30);
  const cv::Mat depth = numberedDepth(camera);
  const cv::Mat result = correctedDepth(depth, camera, Calibration(), DepthError::Zero());
  EXPECT_EQ(cv::norm(result, depth, cv::NORM_INF), 0);
  EXPECT_NE(result.data, depth.data); // the frame's own image stays as it is
}

TEST(CorrectedDepth, OfAnImageUsesTheRaysOfTheCorrectedCamera)
{
  const CameraIntrinsics camera = smallCamera(40, 30, 30);
  Calibration calibration = someDepthFaults();
  calibration[P::FOCAL_X] = 0.05;
  calibration[P::CENTER_Y] = 3;
  const CameraIntrinsics exact = calibration.corrected(camera);
  const DepthError error(1, 2, -1);
  cv::Mat depth(camera.height, camera.width, CV_32F);
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u) {
      const Eigen::Vector3d ray = exact.unproject(u, v, 1);
      depth.at<float>(v, u) =
          float(measuredDepth(2 + 0.01 * u, ray.x(), ray.y(), calibration, error));
    }
  depth.at<float>(4, 7) = HOLE;
  const cv::Mat before = depth.clone();
  const cv::Mat result = correctedDepth(depth, camera, calibration, error);
  ASSERT_EQ(result.size(), depth.size());
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u)
      if (u == 7 && v == 4) {
        EXPECT_TRUE(std::isnan(result.at<float>(v, u)));
      }
      else {
        ASSERT_NEAR(result.at<float>(v, u), 2 + 0.01 * u, 1e-4);
      }
  EXPECT_EQ(depth.at<float>(10, 10), before.at<float>(10, 10)); // is not written to
}

TEST(CorrectedDepth, IsFoundAtTheShiftedPixel)
{
  const CameraIntrinsics camera = smallCamera(40, 30, 30);
  Calibration calibration;
  calibration[P::DEPTH_SHIFT_X] = 3;
  calibration[P::DEPTH_SHIFT_Y] = -2;
  cv::Mat depth = numberedDepth(camera);
  depth.at<float>(10, 20) = HOLE;
  const cv::Mat result = correctedDepth(depth, camera, calibration, DepthError::Zero());
  for (int v = 0; v < 30; ++v)
    for (int u = 0; u < 40; ++u) {
      const bool outside = u + 3 >= 40 || v - 2 < 0, hole = u + 3 == 20 && v - 2 == 10;
      if (outside || hole) {
        EXPECT_TRUE(std::isnan(result.at<float>(v, u))) << u << ", " << v;
      }
      else {
        EXPECT_EQ(result.at<float>(v, u), depth.at<float>(v - 2, u + 3)) << u << ", " << v;
      }
    }
}

TEST(CorrectedFrame, RemovesRadialDistortionFromBothImages)
{
  // A white disc, and depth where it is: where a distorted camera sees the ray (0.4,
  // 0.3, 1).
  const CameraIntrinsics camera = smallCamera(320, 240, 250);
  Calibration calibration;
  calibration[P::RADIAL_1] = 0.1;
  calibration[P::RADIAL_2] = -0.05;
  const double r2 = 0.25, radial = 1 + 0.1 * r2 - 0.05 * r2 * r2;
  const Eigen::Vector2d seen = camera.project({0.4 * radial, 0.3 * radial, 1});
  const Eigen::Vector2d ideal = camera.project({0.4, 0.3, 1});
  ASSERT_GT((seen - ideal).norm(), 2);
  RGBDFrame frame;
  frame.id = 7;
  frame.timestamp = 1.5;
  frame.color = cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(0));
  frame.depth = cv::Mat(240, 320, CV_32F, cv::Scalar(HOLE));
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u)
      if ((Eigen::Vector2d(u, v) - seen).norm() < 6) {
        frame.color.at<cv::Vec3b>(v, u) = cv::Vec3b::all(255);
        frame.depth.at<float>(v, u) = 2;
      }
  const RGBDFrame result = correctedFrame(frame, camera, calibration, DepthError::Zero());
  EXPECT_EQ(result.id, 7u);
  EXPECT_EQ(result.timestamp, 1.5);
  Eigen::Vector2d by_color = Eigen::Vector2d::Zero(), by_depth = by_color;
  double color_weight = 0, depth_weight = 0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) {
      const double bright = result.color.at<cv::Vec3b>(v, u)[1];
      by_color += bright * Eigen::Vector2d(u, v);
      color_weight += bright;
      if (std::isnan(result.depth.at<float>(v, u)))
        continue;
      EXPECT_EQ(result.depth.at<float>(v, u), 2);
      by_depth += Eigen::Vector2d(u, v);
      ++depth_weight;
    }
  EXPECT_LT((by_color / color_weight - ideal).norm(), 0.2);
  EXPECT_LT((by_depth / depth_weight - ideal).norm(),
            0.5); // depth comes from the nearest pixel
}

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
  const double before = correctedDepth(2.0, 0.3, -0.2, calibration, DepthError::Zero(), noise);
  Calibration scaled = calibration;
  scaled.scaleDepth(1.1);
  EXPECT_EQ(scaled.depth_scale, 1.1);
  EXPECT_EQ(scaled.depth_scale_origin, DepthScaleOrigin::KNOWN_DISTANCE);
  // The reader multiplies by depth_scale before.
  EXPECT_NEAR(correctedDepth(1.1 * 2.0, 0.3, -0.2, scaled, DepthError::Zero(), noise), 1.1 * before,
              1e-6);
}
