// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/residuals.h"

#include "registration/scenes.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const double STEP = 1e-6;

Pose
aPose(unsigned seed)
{
  return randomMotion(seed, 0.7, 0.8);
}

Eigen::VectorXd
evaluate(const ceres::CostFunction& residual, const double* first, const double* second)
{
  const double* parameters[] = {first, second};
  Eigen::VectorXd error(residual.num_residuals());
  EXPECT_TRUE(residual.Evaluate(parameters, error.data(), nullptr));
  return error;
}

/** Derivative by the six numbers of pose block 0 or 1, by central differences. */
Eigen::MatrixXd
numericByPose(const ceres::CostFunction& residual, const double* first,
              const double* second, int block)
{
  const PoseManifold manifold;
  Eigen::MatrixXd jacobian(residual.num_residuals(), 6);
  for (int k = 0; k < 6; ++k) {
    Eigen::VectorXd side[2];
    for (int s = 0; s < 2; ++s) {
      Vector6d delta = Vector6d::Zero();
      delta[k] = s == 0 ? STEP : -STEP;
      PoseBlock moved;
      manifold.Plus(block == 0 ? first : second, delta.data(), moved.values);
      side[s] = evaluate(residual, block == 0 ? moved.values : first,
                         block == 1 ? moved.values : second);
    }
    jacobian.col(k) = (side[0] - side[1]) / (2 * STEP);
  }
  return jacobian;
}

Eigen::MatrixXd
numericByPoint(const ceres::CostFunction& residual, const double* pose,
               const Eigen::Vector3d& point)
{
  Eigen::MatrixXd jacobian(residual.num_residuals(), 3);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = STEP * Eigen::Vector3d::Unit(k);
    const Eigen::Vector3d plus = point + step, minus = point - step;
    jacobian.col(k) = (evaluate(residual, pose, plus.data()) -
                       evaluate(residual, pose, minus.data())) /
                      (2 * STEP);
  }
  return jacobian;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/** Both Jacobians as the residual gives them, the pose's reduced to its six numbers. */
std::pair<Eigen::MatrixXd, Eigen::MatrixXd>
analytic(const ceres::CostFunction& residual, const double* first, const double* second)
{
  const auto& sizes = residual.parameter_block_sizes();
  const int n = residual.num_residuals();
  RowMajor by_first(n, sizes[0]), by_second(n, sizes[1]);
  const double* parameters[] = {first, second};
  double* jacobians[] = {by_first.data(), by_second.data()};
  Eigen::VectorXd error(n);
  EXPECT_TRUE(residual.Evaluate(parameters, error.data(), jacobians));
  Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
  PoseManifold().PlusJacobian(first, plus.data());
  if (sizes[1] == 7)
    return {by_first * plus, by_second * plus};
  return {by_first * plus, by_second};
}

void
expectJacobians(const ceres::CostFunction& residual, const double* pose,
                const Eigen::Vector3d& point)
{
  const auto [by_pose, by_point] = analytic(residual, pose, point.data());
  const Eigen::MatrixXd numeric = numericByPose(residual, pose, point.data(), 0);
  EXPECT_LT((by_pose - numeric).norm(), 1e-6 * (1 + numeric.norm()))
      << by_pose << "\n\n"
      << numeric;
  EXPECT_LT((by_point - numericByPoint(residual, pose, point)).norm(),
            1e-6 * (1 + numeric.norm()));
}

} // namespace

TEST(PoseBlock, KeepsAPose)
{
  for (unsigned seed = 0; seed < 5; ++seed)
    EXPECT_LT((PoseBlock(aPose(seed)).worldFromCamera().matrix() - aPose(seed).matrix())
                  .norm(),
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
  EXPECT_LT((after.linear() - increment(delta).linear() * before.linear()).norm(),
            1e-12);
  EXPECT_LT((after.translation() - before.translation() - delta.tail<3>()).norm(),
            1e-12);
}

TEST(PixelResidual, IsTheReprojectionErrorInSigmas)
{
  const CameraIntrinsics camera = smallCamera();
  const PoseBlock pose(aPose(2));
  const Eigen::Vector3d point = aPose(2) * Eigen::Vector3d(0.2, -0.1, 2);
  const Eigen::Vector2d pixel = camera.project({0.2, -0.1, 2});
  const PixelResidual residual(camera, pixel - Eigen::Vector2d(3, -1), 0.5);
  EXPECT_LT(
      (evaluate(residual, pose.values, point.data()) - Eigen::Vector2d(6, -2)).norm(),
      1e-9);
}

TEST(PixelResidual, JacobiansAreTheNumericOnes)
{
  const CameraIntrinsics camera = smallCamera();
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Pose pose = aPose(seed);
    expectJacobians(PixelResidual(camera, {40, 50}, 0.7), PoseBlock(pose).values,
                    pose * Eigen::Vector3d(0.3, -0.4, 1.5));
  }
}

TEST(PixelResidual, StaysFiniteBehindTheCamera)
{
  const CameraIntrinsics camera = smallCamera();
  const Pose pose = aPose(3);
  for (const double z : {0.0, -0.5, -3.0}) {
    const Eigen::Vector3d point = pose * Eigen::Vector3d(0.001, -0.002, z);
    const PixelResidual residual(camera, {40, 50}, 0.7);
    const PoseBlock block(pose);
    EXPECT_TRUE(evaluate(residual, block.values, point.data()).allFinite());
    // Its depth is held there, so the residual does not change with it.
    expectJacobians(residual, block.values, point);
  }
}

TEST(DepthResidual, IsTheDepthErrorInSigmas)
{
  const PoseBlock pose(aPose(2));
  const Eigen::Vector3d point = aPose(2) * Eigen::Vector3d(0.2, -0.1, 2);
  EXPECT_NEAR(evaluate(DepthResidual(1.97, 0.01), pose.values, point.data())[0], 3,
              1e-9);
}

TEST(DepthResidual, JacobiansAreTheNumericOnes)
{
  for (unsigned seed = 0; seed < 5; ++seed)
    expectJacobians(DepthResidual(1.4, 0.01), PoseBlock(aPose(seed)).values,
                    aPose(seed) * Eigen::Vector3d(0.3, -0.4, 1.5));
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
  const Vector6d delta =
      (Vector6d() << 0.02, -0.01, 0.03, 0.05, -0.02, 0.01).finished();
  const PoseBlock second(aPose(5));
  const PoseBlock first(aPose(5) * (increment(delta) * measured).inverse());
  const RelativePoseResidual residual(measured, someInformation());
  EXPECT_NEAR(evaluate(residual, first.values, second.values).squaredNorm(),
              delta.dot(someInformation() * delta), 1e-12);
}

TEST(RelativePoseResidual, JacobiansAreTheNumericOnes)
{
  for (const double error : {0.0, 0.01}) {
    const Pose measured = aPose(4);
    const PoseBlock second(aPose(5));
    const PoseBlock first(aPose(5) *
                          (randomMotion(6, error, error) * measured).inverse());
    const RelativePoseResidual residual(measured, someInformation());
    const auto [by_first, by_second] = analytic(residual, first.values, second.values);
    // Exact at the measured motion, of first order in the error elsewhere.
    const double tolerance = 1e-7 + error;
    for (int block = 0; block < 2; ++block) {
      const Eigen::MatrixXd numeric =
          numericByPose(residual, first.values, second.values, block);
      const Eigen::MatrixXd& jacobian = block == 0 ? by_first : by_second;
      EXPECT_LT((jacobian - numeric).norm(), tolerance * numeric.norm()) << block;
    }
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
    const PoseBlock first(aPose(5) *
                          (increment(1e-3 * direction) * measured).inverse());
    const auto error = evaluate(residual, first.values, second.values);
    EXPECT_TRUE(error.allFinite());
    EXPECT_LT(error.norm(), 1e-8);
  }
  const Vector6d other = project * Vector6d::Ones();
  const PoseBlock first(aPose(5) * (increment(1e-3 * other) * measured).inverse());
  EXPECT_GT(evaluate(residual, first.values, second.values).norm(), 1e-3);
}
