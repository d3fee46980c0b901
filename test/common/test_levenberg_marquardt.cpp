// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/levenberg_marquardt.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <limits>

using namespace bundle_icp;

namespace {

/** Rosenbrock's valley, which full Gauss-Newton steps leave. */
struct Valley {
  Eigen::Matrix2d hessian;
  Eigen::Vector2d gradient, damping;
  bool is_definite = true;

  static Eigen::Vector2d
  residual(const Eigen::Vector2d& x)
  {
    return {100 * (x[1] - x[0] * x[0]), 1 - x[0]};
  }

  double
  cost(const Eigen::Vector2d& x)
  {
    return residual(x).squaredNorm() / 2;
  }

  void
  build(const Eigen::Vector2d& x, double factor)
  {
    Eigen::Matrix2d jacobian;
    jacobian << -200 * x[0], 100, -1, 0;
    hessian = jacobian.transpose() * jacobian;
    gradient = jacobian.transpose() * residual(x);
    damping = factor * hessian.diagonal().unaryExpr(&dampedPart);
    hessian.diagonal() += damping;
  }

  std::optional<LeastSquaresStep<Eigen::Vector2d>>
  solve(const Eigen::Vector2d& x)
  {
    if (!is_definite)
      return std::nullopt;
    const Eigen::Vector2d step = -hessian.llt().solve(gradient);
    return LeastSquaresStep<Eigen::Vector2d>{
        x + step, (damping.dot(step.cwiseAbs2()) - gradient.dot(step)) / 2, step.norm() / x.norm()};
  }
};

} // namespace

TEST(LevenbergMarquardt, FollowsACurvedValleyDownhill)
{
  Valley valley;
  Eigen::Vector2d x(-1.2, 1);
  double last = valley.cost(x);
  for (int k = 0; k < 5; ++k) {
    const LeastSquaresResult result = minimise(valley, 3, 1e-12, x);
    EXPECT_EQ(result.initial_cost, last);
    EXPECT_LE(result.final_cost, last);
    EXPECT_EQ(result.final_cost, valley.cost(x));
    last = result.final_cost;
  }
  EXPECT_TRUE(minimise(valley, 100, 1e-12, x).success);
  EXPECT_LT((x - Eigen::Vector2d(1, 1)).norm(), 1e-6);
}

TEST(LevenbergMarquardt, SaysThatItFailed)
{
  Valley valley;
  valley.is_definite = false;
  Eigen::Vector2d x(-1.2, 1);
  EXPECT_FALSE(minimise(valley, 50, 1e-6, x).success);
  EXPECT_EQ(x, Eigen::Vector2d(-1.2, 1));
  x[0] = std::numeric_limits<double>::infinity();
  const LeastSquaresResult result = minimise(valley, 50, 1e-6, x);
  EXPECT_FALSE(result.success);
  EXPECT_EQ(result.iterations, 0);
}
