// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/shared_error.h"

#include "made_matches.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A view whose depth is the same everywhere. */
DepthView
viewAt(float z)
{
  DepthView view;
  view.depth = cv::Mat(12, 16, CV_32F, cv::Scalar(z));
  return view;
}

/** As of an alignment: millimetres and a tenth of a degree. */
Matrix6d
someInformation()
{
  return accumulate(toMatches(randomMatches(200, 1, 0)), 1, 1).H;
}

Matrix6d
sharedCovariance(double z, double sigmas)
{
  const SharedError shared(z, DepthNoise(), sigmas);
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(shared.tilt * shared.tilt),
      Eigen::Vector3d::Constant(shared.shift * shared.shift);
  return variance.asDiagonal();
}

double
smallestEigenvalue(const Matrix6d& matrix)
{
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(matrix).eigenvalues()[0];
}

} // namespace

TEST(SharedError, IsAShiftByTheNoiseAndATiltThatShiftsTheImagesEdgeAlike)
{
  DepthNoise noise;
  noise.constant = 0.001;
  noise.quadratic = 0.002;
  noise.offset = 0.5;
  const SharedError shared(2.5, noise, 2);
  EXPECT_DOUBLE_EQ(shared.shift, 2 * (0.001 + 0.002 * 4));
  EXPECT_DOUBLE_EQ(2.5 * shared.tilt, shared.shift);
}

TEST(SharedError, AddsToTheCovarianceOfIndependentErrors)
{
  const Matrix6d independent = someInformation();
  for (const int frames : {1, 2, 5})
    for (const float z : {0.8f, 3.0f}) {
      const Matrix6d expected =
          (independent.inverse() + frames * sharedCovariance(double(z), 2)).inverse();
      const Matrix6d actual = withSharedError(independent, viewAt(z), DepthNoise(), 2, frames);
      EXPECT_LT(difference(actual, expected), 1e-6) << frames << " images at " << z << " m";
      EXPECT_EQ(actual, actual.transpose());
    }
}

TEST(SharedError, IsTheLimitOfAnyNumberOfMeasurementsAndNothingWithoutSigmas)
{
  const Matrix6d independent = someInformation();
  const Matrix6d limit = sharedCovariance(1.5, 2).inverse();
  EXPECT_LT(difference(withSharedError(1e4 * independent, viewAt(1.5f), {}, 2, 1), limit), 0.01);
  EXPECT_LT(difference(withSharedError(independent, viewAt(1.5f), {}, 1e-4, 1), independent), 1e-3);
}

TEST(SharedError, NeverAddsInformationAndMoreSigmasLeaveLess)
{
  const Matrix6d independent = someInformation();
  Matrix6d before = independent;
  for (const double sigmas : {0.1, 0.5, 2.0, 8.0}) {
    const Matrix6d left = withSharedError(independent, viewAt(1.5f), {}, sigmas, 1);
    EXPECT_GT(smallestEigenvalue(left), 0) << sigmas;
    EXPECT_GT(smallestEigenvalue(before - left), 0) << sigmas;
    before = left;
  }
}

TEST(SharedError, OpenDirectionsStayOpen)
{
  // A plane holds one translation and two turns.
  Matrix6d plane = Matrix6d::Zero();
  plane.diagonal() << 1e5, 1e5, 0, 0, 0, 1e6;
  const Matrix6d left = withSharedError(plane, viewAt(1.5f), {}, 2, 1);
  const Matrix6d shared = sharedCovariance(1.5, 2);
  for (int k = 0; k < 6; ++k) {
    const double expected = plane(k, k) > 0 ? 1 / (1 / plane(k, k) + shared(k, k)) : 0;
    EXPECT_NEAR(left(k, k), expected, 1e-9 * plane.maxCoeff()) << k;
  }
  EXPECT_EQ(withSharedError(Matrix6d::Zero(), viewAt(1.5f), {}, 2, 1), Matrix6d::Zero());
}

TEST(SharedError, TakesTheMeanOfWhatWasMeasured)
{
  const Matrix6d independent = someInformation();
  DepthView holed = viewAt(1);
  holed.depth.colRange(0, 4).setTo(3);
  holed.depth.colRange(8, 16).setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_LT(difference(withSharedError(independent, holed, {}, 2, 1),
                       withSharedError(independent, viewAt(2), {}, 2, 1)),
            1e-6);
  // Nothing measured: as at the nearest depth, and nothing is divided by zero.
  const Matrix6d blind =
      withSharedError(independent, viewAt(std::numeric_limits<float>::quiet_NaN()), {}, 2, 1);
  const Matrix6d expected = (independent.inverse() + sharedCovariance(0.1, 2)).inverse();
  EXPECT_LT(difference(blind, expected), 1e-6);
}
