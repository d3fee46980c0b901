// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "made_matches.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Some information matrix with eigenvalues of different size. */
Matrix6d
someInformation()
{
  const DenseSystem system = accumulate(toMatches(randomMatches(200, 1, 0)), 1, 1);
  return system.H;
}

/** Gradients of a covariance that is `factor` times H, shared by `count` tiles. */
std::vector<Vector6d>
drawGradients(const Matrix6d& H, double factor, int count, unsigned seed = 1)
{
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Matrix6d root = Eigen::LLT<Matrix6d>(H).matrixL();
  std::vector<Vector6d> gradients;
  for (int i = 0; i < count; ++i) {
    Vector6d draw;
    for (double& value : draw)
      value = std::sqrt(factor / count) * normal(random);
    gradients.push_back(root * draw);
  }
  return gradients;
}

/** A linear problem: tiles of measurements of one line of six numbers each, that share an error. */
struct TiledProblem {
  static constexpr int TILES = 300, MEASUREMENTS = 9;
  std::vector<Vector6d> rows;

  TiledProblem()
  {
    std::mt19937 random(5);
    for (int i = 0; i < TILES * MEASUREMENTS; ++i) {
      Vector6d row;
      row << randomVector(random), randomVector(random) + Eigen::Vector3d::Ones();
      rows.push_back(row);
    }
  }

  /** The normalised squared error of the estimate: 6 on average for a true covariance. */
  std::pair<double, double>
  normalisedErrors(unsigned seed) const
  {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<double> errors;
    for (int tile = 0; tile < TILES; ++tile) {
      const double shared = normal(random);
      for (int k = 0; k < MEASUREMENTS; ++k)
        errors.push_back(shared + normal(random));
    }
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      H += rows[i] * rows[i].transpose();
      g += rows[i] * errors[i];
    }
    const Vector6d estimate = H.ldlt().solve(g); // its truth is 0
    std::vector<Vector6d> gradients(TILES, Vector6d::Zero());
    for (std::size_t i = 0; i < rows.size(); ++i)
      gradients[i / MEASUREMENTS] += rows[i] * (errors[i] - rows[i].dot(estimate));
    const Matrix6d robust = robustInformation(H, 1, gradients, 0);
    return {estimate.dot(H * estimate), estimate.dot(robust * estimate)};
  }
};

} // namespace

TEST(RobustInformation, FewTilesShowNothing)
{
  const Matrix6d information = someInformation();
  EXPECT_EQ(robustInformation(information, 3, drawGradients(information, 50, 11), 0), information);
  EXPECT_GT(difference(robustInformation(information, 3, drawGradients(information, 50, 12), 0),
                       information),
            0.1);
}

TEST(RobustInformation, OfTheModelAloneIsThatOfTheModelAndTheLeastVariance)
{
  const Matrix6d information = someInformation();
  for (const double variance : {1.0, 9.0, 81.0}) {
    const Matrix6d expected = information * (variance / (variance + 0.25));
    const Matrix6d actual =
        robustInformation(information, variance, drawGradients(information, 1e3, 40), 1);
    EXPECT_LT(difference(actual, expected), 1e-9) << variance;
  }
}

TEST(RobustInformation, OfManyTilesIsThatWhichTheirScatterTells)
{
  const Matrix6d information = someInformation();
  for (const double factor : {0.5, 1.0, 20.0}) {
    const Matrix6d actual =
        robustInformation(information, 1, drawGradients(information, factor, 20000), 0);
    const Matrix6d expected = information / (0.25 + factor);
    EXPECT_LT(difference(actual, expected), 0.05) << factor;
  }
}

TEST(RobustInformation, DataThatAgreeByChanceAreNotExact)
{
  const Matrix6d information = someInformation();
  const std::vector<Vector6d> none(100, Vector6d::Zero());
  EXPECT_LT(difference(robustInformation(information, 1, none, 0), Matrix6d(4 * information)),
            1e-9);
}

TEST(RobustInformation, KnowsTheErrorsThatPixelsOfATileShare)
{
  // Without shared errors both means were 6; here nine measurements share half of their variance.
  const TiledProblem problem;
  constexpr unsigned RUNS = 300;
  double naive = 0, robust = 0;
  for (unsigned seed = 0; seed < RUNS; ++seed) {
    const auto [of_run, of_run_robust] = problem.normalisedErrors(seed);
    naive += of_run / RUNS;
    robust += of_run_robust / RUNS;
  }
  EXPECT_GT(naive, 12);
  EXPECT_NEAR(robust, 6, 1.2);
}

TEST(RobustInformation, OpenDirectionsStayOpen)
{
  Matrix6d information = someInformation();
  const Vector6d open = (Vector6d() << 1, 2, 3, -1, 0, 2).finished().normalized();
  const Matrix6d held = Matrix6d::Identity() - open * open.transpose();
  information = held * information * held;
  const Matrix6d result =
      robustInformation(information, 2, drawGradients(someInformation(), 4, 100), 0.2);
  EXPECT_TRUE(result.allFinite());
  EXPECT_LT((result * open).norm(), 1e-9 * result.norm());
  EXPECT_EQ(result, result.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(result);
  EXPECT_GT(eigen.eigenvalues()[1], 0);
  EXPECT_EQ(robustInformation(Matrix6d::Zero(), 2,
                              drawGradients(information + Matrix6d::Identity(), 4, 100), 0.2),
            Matrix6d::Zero());
}

TEST(RobustInformation, FollowsFrameCentreAndUnit)
{
  const Matrix6d information = someInformation();
  std::vector<Vector6d> gradients = drawGradients(information, 4, 50);
  const Matrix6d here = robustInformation(information, 2, gradients, 0.3);
  Vector6d unit = Vector6d::Ones();
  unit.tail<3>().setConstant(0.1);
  const Matrix6d change = turned(randomMotion(3, 2, 0).linear()) *
                          motionsAbout({0.2, 0.5, -0.3}, Eigen::Vector3d::Zero()) *
                          unit.asDiagonal();
  for (Vector6d& gradient : gradients)
    gradient = change.transpose() * gradient;
  const Matrix6d there =
      robustInformation(change.transpose() * information * change, 2, gradients, 0.3);
  EXPECT_LT(difference(there, Matrix6d(change.transpose() * here * change)), 1e-6);
}
