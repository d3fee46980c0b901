// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/residuals.h"

#include "registration/scenes.h"

#include <ceres/gradient_checker.h>
#include <ceres/manifold_test_utils.h>
#include <gtest/gtest.h>

#include <vector>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

Pose
aPose(unsigned seed)
{
  return randomMotion(seed, 0.7, 0.8);
}

/** Values of a residual's parameter blocks, in their order. */
using Blocks = std::vector<Eigen::VectorXd>;

Eigen::VectorXd
toBlock(const PoseBlock& pose)
{
  return Eigen::Map<const Eigen::Matrix<double, 7, 1>>(pose.values);
}

std::vector<const double*>
pointersTo(const Blocks& blocks)
{
  std::vector<const double*> pointers;
  for (const Eigen::VectorXd& block : blocks)
    pointers.push_back(block.data());
  return pointers;
}

Eigen::VectorXd
evaluate(const ceres::CostFunction& residual, const Blocks& blocks)
{
  Eigen::VectorXd error(residual.num_residuals());
  EXPECT_TRUE(residual.Evaluate(pointersTo(blocks).data(), error.data(), nullptr));
  return error;
}

/** Compares all derivatives with those by finite differences. */
void
expectJacobians(const ceres::CostFunction& residual, const Blocks& blocks)
{
  const PoseManifold manifold;
  std::vector<const ceres::Manifold*> manifolds;
  for (const Eigen::VectorXd& block : blocks)
    manifolds.push_back(block.size() == 7 ? &manifold : nullptr);
  ceres::NumericDiffOptions options;
  options.ridders_relative_initial_step_size = 1e-3;
  const ceres::GradientChecker checker(&residual, &manifolds, options);
  ceres::GradientChecker::ProbeResults results;
  EXPECT_TRUE(checker.Probe(pointersTo(blocks).data(), 1e-6, &results)) << results.error_log;
}

/** A calibration in which nothing is zero. */
CalibrationVector
someCalibration()
{
  CalibrationVector c;
  c << 0.02, -0.03, 4, -3, 0.05, -0.02, 0.01, 0.02, -0.03, 1.5, -2, 0.03, -0.02;
  return c;
}

/** A frame with one feature. */
struct Measured {
  CameraIntrinsics camera = smallCamera();
  FrameMeasurement frame{camera};
  DepthNoise noise;
  Features features;

  Measured(const Eigen::Vector2d& pixel, double pixel_sigma, double depth = 0,
           double depth_sigma = 1)
  {
    features.pixels.push_back(pixel.cast<float>());
    features.pixel_sigmas.push_back(float(pixel_sigma));
    features.depths.push_back(float(depth));
    features.depth_sigmas.push_back(float(depth_sigma));
  }

  Measured(const Measured&) = delete; // `frame` refers to the camera

  Measured&
  moving()
  {
    frame.motion << 0.5, -0.8, 0.6, 0.3, -0.4, 0.5;
    features.depth_slopes.emplace_back(0.01f, -0.02f);
    return *this;
  }

  PixelResidual
  pixelResidual() const
  {
    return PixelResidual(frame, features, 0);
  }

  DepthResidual
  depthResidual() const
  {
    return DepthResidual(frame, noise, features, 0);
  }
};

} // namespace

TEST(PoseBlock, KeepsAPose)
{
  for (unsigned seed = 0; seed < 5; ++seed)
    EXPECT_LT((PoseBlock(aPose(seed)).worldFromCamera().matrix() - aPose(seed).matrix()).norm(),
              1e-14);
}

TEST(PoseManifold, MinusInvertsPlus)
{
  const PoseManifold manifold;
  const PoseBlock x(aPose(1));
  const Vector6d delta = (Vector6d() << 0.3, -0.2, 0.5, 1, -2, 0.1).finished();
  PoseBlock y;
  ASSERT_TRUE(manifold.Plus(x.values, delta.data(), y.values));
  Vector6d difference;
  ASSERT_TRUE(manifold.Minus(y.values, x.values, difference.data()));
  EXPECT_LT((difference - delta).norm(), 1e-12);
  // Rotation on the left of camera_from_world, translation added.
  const Pose before = aPose(1).inverse(), after = y.worldFromCamera().inverse();
  EXPECT_LT((after.linear() - increment(delta).linear() * before.linear()).norm(), 1e-12);
  EXPECT_LT((after.translation() - before.translation() - delta.tail<3>()).norm(), 1e-12);
}

TEST(PoseManifold, IsOneAsCeresKnowsThem)
{
  using namespace ceres;
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::VectorXd x = toBlock(PoseBlock(aPose(seed))),
                          y = toBlock(PoseBlock(aPose(seed + 7)));
    const Eigen::VectorXd delta = 0.7 * Vector6d::Ones() - 0.2 * logarithm(aPose(seed + 1));
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(PoseManifold(), x, delta, y, 1e-9);
  }
}

TEST(PixelResidual, IsTheReprojectionErrorInSigmas)
{
  const Eigen::Vector3d in_camera(0.2, -0.1, 2), point = aPose(2) * in_camera;
  const Measured measured(smallCamera().project(in_camera) - Eigen::Vector2d(3, -1), 0.5);
  const Blocks blocks{toBlock(PoseBlock(aPose(2))), point, CalibrationVector::Zero()};
  // Pixels are stored as floats.
  EXPECT_LT((evaluate(measured.pixelResidual(), blocks) - Eigen::Vector2d(6, -2)).norm(), 1e-4);
}

TEST(PixelResidual, JacobiansAreTheNumericOnes)
{
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Pose pose = aPose(seed);
    const Eigen::Vector3d point = pose * Eigen::Vector3d(0.3, -0.4, 1.5);
    for (const CalibrationVector& calibration :
         {CalibrationVector(CalibrationVector::Zero()), someCalibration()})
      expectJacobians(Measured({40, 15}, 0.7).moving().pixelResidual(),
                      {toBlock(PoseBlock(pose)), point, calibration});
  }
}

TEST(PixelResidual, StaysFiniteBehindTheCamera)
{
  const Pose pose = aPose(3);
  Measured measured({40, 15}, 0.7);
  measured.moving();
  CalibrationVector calibration = someCalibration();
  calibration[int(CalibrationParameter::RADIAL_1)] = 0; // no polynomial holds out here
  calibration[int(CalibrationParameter::RADIAL_2)] = 0;
  for (const double z : {-0.05, -0.5, -3.0}) {
    const Eigen::Vector3d point = pose * Eigen::Vector3d(0.001, -0.002, z);
    const Blocks blocks{toBlock(PoseBlock(pose)), point, calibration};
    EXPECT_TRUE(evaluate(measured.pixelResidual(), blocks).allFinite());
    // Its depth is held there, so the residual does not change with it.
    expectJacobians(measured.pixelResidual(), blocks);
  }
}

TEST(DepthResidual, IsTheDepthErrorInSigmas)
{
  const Eigen::Vector3d point = aPose(2) * Eigen::Vector3d(0.2, -0.1, 2);
  const Measured measured({80, 60}, 1, 1.97, 0.01);
  const Blocks blocks{toBlock(PoseBlock(aPose(2))), point, CalibrationVector::Zero(),
                      DepthError::Zero()};
  EXPECT_NEAR(evaluate(measured.depthResidual(), blocks)[0], 3, 1e-4);
}

TEST(DepthResidual, ComparesWithTheDepthOfTheShiftedPixel)
{
  // A wall that recedes by 2 cm per pixel to the right; depth lies 3 px further right,
  // so that at the feature's pixel the depth of 3 px to its left is found.
  Measured measured({80, 60}, 1, 2 - 0.06, 0.01);
  measured.features.depth_slopes.emplace_back(0.02f, 0.f);
  CalibrationVector calibration = CalibrationVector::Zero();
  calibration[int(CalibrationParameter::DEPTH_SHIFT_X)] = 3;
  const Eigen::Vector3d point(0, 0, 2);
  const auto residual = [&] {
    return evaluate(measured.depthResidual(),
                    {toBlock(PoseBlock()), point, calibration, DepthError::Zero()})[0];
  };
  EXPECT_NEAR(residual(), 0, 1e-4);
  calibration.setZero();
  EXPECT_NEAR(residual(), 6, 1e-4);
}

TEST(DepthResidual, JacobiansAreTheNumericOnes)
{
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Pose pose = aPose(seed);
    const Eigen::Vector3d point = pose * Eigen::Vector3d(0.3, -0.4, 1.5);
    // Not zero: relative errors of derivatives that vanish say nothing.
    for (const double scale : {1.0, -0.5})
      expectJacobians(
          Measured({40, 15}, 0.7, 1.4, 0.01).moving().depthResidual(),
          {toBlock(PoseBlock(pose)), point, scale * someCalibration(), DepthError(1.5, -0.8, 2.1)});
  }
}

namespace {

/** A positive definite form with coupled directions. */
Matrix6d
someInformation()
{
  Matrix6d root = Matrix6d::Identity();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      root(i, j) += 0.3 * std::sin(1 + 3 * i + 7 * j);
  return root.transpose() * root;
}

} // namespace

TEST(RelativePoseResidual, SquaredNormIsTheQuadraticForm)
{
  const Pose measured = aPose(4);
  const Vector6d delta = (Vector6d() << 0.02, -0.01, 0.03, 0.05, -0.02, 0.01).finished();
  const PoseBlock second(aPose(5));
  const PoseBlock first(aPose(5) * (increment(delta) * measured).inverse());
  const RelativePoseResidual residual(measured, someInformation());
  EXPECT_NEAR(evaluate(residual, {toBlock(first), toBlock(second)}).squaredNorm(),
              delta.dot(someInformation() * delta), 1e-12);
}

TEST(RelativePoseResidual, JacobiansAreTheNumericOnes)
{
  for (const double error : {0.0, 1e-4, 0.01, 0.5}) {
    const Pose measured = aPose(4);
    const PoseBlock second(aPose(5));
    const PoseBlock first(aPose(5) * (randomMotion(6, error, error) * measured).inverse());
    expectJacobians(RelativePoseResidual(measured, someInformation()),
                    {toBlock(first), toBlock(second)});
  }
}

TEST(RelativePoseResidual, IsZeroAlongFreeDirections)
{
  // Geometry says nothing on two directions.
  Vector6d a = Vector6d::Zero(), b = Vector6d::Zero();
  a << 0, 0, 1, 0.5, 0, 0;
  b << 0, 0, 0, 0, 1, 0;
  a.normalize();
  const Matrix6d project = Matrix6d::Identity() - a * a.transpose() - b * b.transpose();
  const Matrix6d information = 1e4 * project * someInformation() * project;
  const Pose measured = aPose(4);
  const RelativePoseResidual residual(measured, information);
  const PoseBlock second(aPose(5));
  for (const Vector6d& direction : {a, b}) {
    const PoseBlock first(aPose(5) * (increment(1e-3 * direction) * measured).inverse());
    const auto error = evaluate(residual, {toBlock(first), toBlock(second)});
    EXPECT_TRUE(error.allFinite());
    EXPECT_LT(error.norm(), 1e-8);
  }
  const Vector6d other = project * Vector6d::Ones();
  const PoseBlock first(aPose(5) * (increment(1e-3 * other) * measured).inverse());
  EXPECT_GT(evaluate(residual, {toBlock(first), toBlock(second)}).norm(), 1e-3);
}

TEST(ObservationResiduals, RowsGiveTheGradientOfTheCost)
{
  const Pose pose = aPose(2);
  const Eigen::Vector3d point = pose * Eigen::Vector3d(0.3, -0.4, 1.5);
  for (const bool has_depth : {true, false}) {
    Measured measured({100, 15}, 0.7, has_depth ? 1.4 : 0, 0.01);
    measured.moving();
    const ObservationResiduals residuals(measured.frame, measured.features, 0, &measured.noise);
    EXPECT_EQ(residuals.depth != nullptr, has_depth);
    const Blocks blocks{toBlock(PoseBlock(pose)), point, someCalibration(),
                        DepthError(1.5, -0.8, 2.1)};
    const ObservationRows rows = residuals.linearise(pointersTo(blocks).data(), 2, true);
    const auto cost = [&](std::size_t b, Eigen::Index k, double step) {
      Blocks moved = blocks;
      Vector6d motion = Vector6d::Zero();
      if (b == 0) {
        motion[k] = step;
        PoseManifold().Plus(blocks[0].data(), motion.data(), moved[0].data());
      }
      else
        moved[b][k] += step;
      return residuals.cost(pointersTo(moved).data(), 2) / 2;
    };
    const Eigen::VectorXd gradients[] = {rows.by_frame.leftCols<6>().transpose() * rows.residual,
                                         rows.by_point.transpose() * rows.residual,
                                         rows.by_calibration.transpose() * rows.residual,
                                         rows.by_frame.rightCols<3>().transpose() * rows.residual};
    for (std::size_t b = 0; b < 4; ++b)
      for (Eigen::Index k = 0; k < gradients[b].size(); ++k) {
        const double numeric = (cost(b, k, 1e-6) - cost(b, k, -1e-6)) / 2e-6;
        EXPECT_NEAR(gradients[b][k], numeric, 1e-5 * (1 + gradients[b].norm())) << b << " " << k;
      }
    EXPECT_EQ(gradients[3].norm() > 0, has_depth);
  }
}
