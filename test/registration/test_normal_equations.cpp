// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "made_matches.h"

#include "variants.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Tukey's cost of a normalised residual, whose derivative is residual times weight. */
double
tukeyCost(double error, double cutoff)
{
  const double inside = std::max(0.0, 1 - error * error / (cutoff * cutoff));
  return cutoff * cutoff / 6 * (1 - inside * inside * inside);
}

/** The residual after a motion: the match stays where it is, on the plane along the normal. */
double
residualAfter(const MadeMatch& match, const Vector6d& delta)
{
  return match.residual + match.normal.dot(increment(delta) * match.point - match.point);
}

double
costAfter(const std::vector<MadeMatch>& made, double scale, const Vector6d& delta)
{
  double cost = 0;
  for (const MadeMatch& match : made)
    cost += tukeyCost(residualAfter(match, delta) / match.sigma, TUKEY_CUTOFF * scale);
  return cost;
}

template <typename Cost>
Vector6d
gradientOf(const Cost& cost)
{
  constexpr double STEP = 1e-6;
  Vector6d gradient;
  for (int k = 0; k < 6; ++k)
    gradient[k] = (cost(STEP * Vector6d::Unit(k)) - cost(-STEP * Vector6d::Unit(k))) / (2 * STEP);
  return gradient;
}

template <typename Cost>
Matrix6d
hessianOf(const Cost& cost)
{
  constexpr double STEP = 1e-5;
  Matrix6d hessian;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      const Vector6d u = STEP * Vector6d::Unit(a), v = STEP * Vector6d::Unit(b);
      hessian(a, b) = (cost(u + v) - cost(u - v) - cost(v - u) + cost(-u - v)) / (4 * STEP * STEP);
    }
  return hessian;
}

void
expectEqual(const DenseSystem& a, const DenseSystem& b)
{
  EXPECT_EQ(a.H, b.H);
  EXPECT_EQ(a.g, b.g);
  EXPECT_EQ(a.structure, b.structure);
  EXPECT_EQ(a.weight, b.weight);
  EXPECT_EQ(a.squared_error, b.squared_error);
  EXPECT_EQ(a.matched, b.matched);
  EXPECT_EQ(a.inliers, b.inliers);
}

/** Exact pairs under a pose, displaced by up to some sigmas. */
VisualCorrespondences
randomPairs(const Pose& pose, std::size_t size, double errors)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> sigma(0.005, 0.02);
  VisualCorrespondences pairs;
  for (std::size_t i = 0; i < size; ++i) {
    const double of_pair = sigma(random);
    pairs.source.push_back(randomVector(random));
    pairs.target.push_back(pose * pairs.source.back() + errors * of_pair * randomVector(random));
    pairs.weights.push_back(1 / (of_pair * of_pair));
  }
  return pairs;
}

} // namespace

TEST(DenseNormalEquations, GradientIsThatOfTukeysCost)
{
  for (const double scale : {0.7, 1.0, 3.0}) {
    const std::vector<MadeMatch> made = randomMatches(300, 1, 2);
    const Vector6d expected =
        gradientOf([&](const Vector6d& delta) { return costAfter(made, scale, delta); });
    const DenseSystem system = accumulate(toMatches(made), scale, 1);
    EXPECT_LT(difference(system.g, expected), 1e-4) << "scale " << scale;
  }
}

TEST(DenseNormalEquations, MatrixIsTheCurvatureOfTheCostWhereSurfacesMeet)
{
  const std::vector<MadeMatch> made = randomMatches(300, 2, 0);
  const Matrix6d expected =
      hessianOf([&](const Vector6d& delta) { return costAfter(made, 1, delta); });
  const DenseSystem system = accumulate(toMatches(made), 1, 1);
  EXPECT_LT(difference(system.H, expected), 1e-4);
  EXPECT_EQ(system.H, system.H.transpose());
}

TEST(DenseNormalEquations, OneStepBringsBackASmallMotion)
{
  std::vector<MadeMatch> made = randomMatches(500, 3, 0);
  Vector6d motion;
  motion << 2e-4, -1e-4, 3e-4, 1e-3, -5e-4, 2e-4;
  for (MadeMatch& match : made)
    match.residual = residualAfter(match, motion);
  const DenseSystem system = accumulate(toMatches(made), 1, 1);
  const Vector6d step = -system.H.ldlt().solve(system.g);
  EXPECT_LT(difference(step, Vector6d(-motion)), 1e-2);
}

TEST(DenseNormalEquations, SumsOfFewMatchesAreThoseOfAHandCalculation)
{
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  // At scale 2 the cutoff lies at 9.37 sigmas and inliers end at 6.
  const std::vector<MadeMatch> made = {
      {x, z, 0.01, 0.01}, {x, z, -0.04, 0.02}, {x, z, 0.07, 0.01}, {x, z, 0.5, 0.01}};
  const DenseSystem system = accumulate(toMatches(made), 2, 1);
  const double w[] = {robustWeight(0.5), robustWeight(1), robustWeight(3.5)};
  EXPECT_EQ(robustWeight(0), 1);
  EXPECT_EQ(robustWeight(5), 0);
  EXPECT_EQ(system.matched, 4u);
  EXPECT_EQ(system.inliers, 2u);
  EXPECT_NEAR(system.squared_inliers, 0.01 * 0.01 + 0.04 * 0.04, 1e-9);
  EXPECT_NEAR(system.weight_metric, w[0] + w[1] + w[2], 1e-6);
  EXPECT_NEAR(system.weight, w[0] * 1e4 + w[1] * 2500 + w[2] * 1e4, 1e-1);
  EXPECT_NEAR(system.squared_error, w[0] * 1e-4 + w[1] * 16e-4 + w[2] * 49e-4, 1e-8);
  // All push along z with a lever of 1 m along x: turns about -y.
  EXPECT_NEAR(system.H(5, 5), system.weight, 1e-1);
  EXPECT_NEAR(system.H(1, 1), system.weight, 1e-1);
  EXPECT_NEAR(system.H(1, 5), -system.weight, 1e-1);
  EXPECT_NEAR(system.H.row(0).norm(), 0, 1e-6);
}

TEST(DenseNormalEquations, MatchesBeyondTheCutoffAndEntriesWithoutMatchWeighNothing)
{
  std::vector<MadeMatch> made = randomMatches(100, 4, 1);
  const DenseSystem without = accumulate(toMatches(made), 1, 1);
  for (MadeMatch far : randomMatches(50, 5, 0)) {
    far.residual = 1.001 * TUKEY_CUTOFF * far.sigma;
    made.push_back(far);
  }
  Matches matches = toMatches(made);
  for (std::size_t i = 0; i < 25; ++i) {
    matches.target[100 + i] = -1;
    matches.inverse_sigma[100 + i] = 0;
  }
  const DenseSystem with = accumulate(matches, 1, 1);
  EXPECT_LT(difference(with.H, without.H), 1e-6);
  EXPECT_LT(difference(with.g, without.g), 1e-5);
  EXPECT_EQ(with.matched, 125u) << "those beyond the cutoff are matched all the same";
  EXPECT_EQ(with.inliers, without.inliers);
}

TEST(DenseNormalEquations, NoiseOfNormalsCancelsInTheStructureAlone)
{
  // A plane whose measured normals shake by 2 degrees: sliding along it seems held by H.
  std::mt19937 random(6);
  std::vector<MadeMatch> made;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = randomVector(random);
    MadeMatch match{{p.x(), p.y(), 0}, Eigen::Vector3d::UnitZ()};
    match.normal = (Eigen::Vector3d::UnitZ() + 0.035 * randomVector(random)).normalized();
    match.source_normal = (Eigen::Vector3d::UnitZ() + 0.035 * randomVector(random)).normalized();
    made.push_back(match);
  }
  const DenseSystem system = accumulate(toMatches(made), 1, 1);
  EXPECT_NEAR(system.H(3, 3) / system.weight, 0.035 * 0.035, 1e-4);
  EXPECT_NEAR(system.structure(3, 3) / system.weight, 0, 5e-5);
  EXPECT_NEAR(system.structure(5, 5) / system.weight, 1, 0.01);
}

TEST(DenseNormalEquations, ThreadsAndInstructionSetsGiveTheSameBits)
{
  const Matches matches = toMatches(randomMatches(20000, 7, 1.5));
  const DenseSystem expected = accumulate(matches, 1, 1);
  forEachVariant([&] {
    for (const int threads : {1, 2, 5})
      expectEqual(accumulate(matches, 1, threads), expected);
  });
}

TEST(DenseNormalEquations, OrderOfMatchesDoesNotMatter)
{
  std::vector<MadeMatch> made = randomMatches(9000, 8, 1.5);
  const DenseSystem before = accumulate(toMatches(made), 1, 1);
  std::mt19937 random(8);
  std::shuffle(made.begin(), made.end(), random);
  const DenseSystem after = accumulate(toMatches(made), 1, 1);
  EXPECT_LT(difference(after.H, before.H), 1e-5);
  EXPECT_LT(difference(after.g, before.g), 1e-4);
  EXPECT_EQ(after.inliers, before.inliers);
}

TEST(DenseNormalEquations, FollowTheFrameTheCentreAndTheUnitOfLength)
{
  const std::vector<MadeMatch> made = randomMatches(2000, 9, 1);
  const DenseSystem here = accumulate(toMatches(made), 1, 1);
  const Eigen::Matrix3d rotation = randomMotion(9, 2, 0).linear();
  const Eigen::Vector3d center(0.5, -1, 2);
  std::vector<MadeMatch> in_turned = made, about_center = made, in_decimetres = made;
  for (std::size_t i = 0; i < made.size(); ++i) {
    for (Eigen::Vector3d* v :
         {&in_turned[i].point, &in_turned[i].normal, &in_turned[i].source_normal})
      *v = rotation * *v;
    about_center[i].point -= center;
    in_decimetres[i].point *= 10;
    in_decimetres[i].residual *= 10;
    in_decimetres[i].sigma *= 10;
  }
  const Matrix6d turn = turned(rotation);
  const DenseSystem there = accumulate(toMatches(in_turned), 1, 1);
  EXPECT_LT(difference(there.H, Matrix6d(turn * here.H * turn.transpose())), 1e-5);
  EXPECT_LT(difference(there.g, Vector6d(turn * here.g)), 1e-4);

  // A turn about the centre moves the origin by center x turn.
  const Matrix6d origin_from_center = motionsAbout(center, Eigen::Vector3d::Zero());
  const DenseSystem centered = accumulate(toMatches(about_center), 1, 1);
  const Matrix6d expected = origin_from_center.transpose() * here.H * origin_from_center;
  EXPECT_LT(difference(centered.H, expected), 1e-5);

  Vector6d unit = Vector6d::Ones();
  unit.tail<3>().setConstant(0.1);
  const DenseSystem scaled = accumulate(toMatches(in_decimetres), 1, 1);
  EXPECT_LT(difference(scaled.H, Matrix6d(unit.asDiagonal() * here.H * unit.asDiagonal())), 1e-5);
  EXPECT_EQ(scaled.inliers, here.inliers);
}

TEST(VisualNormalEquations, GradientAndMatrixAreThoseOfTheRobustCost)
{
  const Pose pose = randomMotion(10, 1, 2);
  const Eigen::Vector3d center(0.3, 0.2, 1);
  constexpr double SCALE = 1.5, LIMIT = 16;
  const auto costOf = [&](const VisualCorrespondences& pairs) {
    return [&pairs, &pose, &center](const Vector6d& delta) {
      const Eigen::Translation3d to_center(center);
      const Pose moved = to_center * increment(delta) * to_center.inverse() * pose;
      double cost = 0;
      for (std::size_t i = 0; i < pairs.source.size(); ++i) {
        const double squared = (moved * pairs.source[i] - pairs.target[i]).squaredNorm();
        const double error = pairs.weights[i] * squared / (SCALE * SCALE);
        cost += LIMIT / 6 * (1 - std::pow(std::max(0.0, 1 - error / LIMIT), 3));
      }
      return cost;
    };
  };
  const VisualCorrespondences noisy_pairs = randomPairs(pose, 200, 2);
  const VisualSystem system = accumulateVisual(noisy_pairs, pose, center, SCALE);
  EXPECT_LT(difference(system.g, gradientOf(costOf(noisy_pairs))), 1e-4);
  EXPECT_GT(system.inliers, 100u);
  EXPECT_LT(system.inliers, 200u) << "some lie beyond the limit, which the cost must know";

  const VisualCorrespondences exact = randomPairs(pose, 200, 0);
  EXPECT_LT(difference(accumulateVisual(exact, pose, center, SCALE).H, hessianOf(costOf(exact))),
            1e-4);
}

TEST(VisualNormalEquations, CostOfAnOutlierIsThatOfFourSigmas)
{
  VisualCorrespondences pairs;
  for (const double distance : {0.01, 0.03, 0.05, 5.0}) {
    pairs.source.push_back({1, 2, 3});
    pairs.target.push_back({1, 2, 3 + distance});
    pairs.weights.push_back(1e4);
  }
  const VisualSystem system = accumulateVisual(pairs, Pose::Identity(), Eigen::Vector3d::Zero(), 1);
  EXPECT_NEAR(system.cost, 1 + 9 + 16 + 16, 1e-9);
  EXPECT_EQ(system.inliers, 2u);
  EXPECT_NEAR(system.squared_inliers, 1e-4 + 9e-4, 1e-12);
  const VisualSystem doubtful =
      accumulateVisual(pairs, Pose::Identity(), Eigen::Vector3d::Zero(), 2);
  EXPECT_EQ(doubtful.inliers, 3u) << "with twice the sigma, 5 cm is 2.5 of them";
  EXPECT_NEAR(doubtful.cost, (1 + 9 + 25) / 4.0 + 16, 1e-9);
}

TEST(VisualNormalEquations, FollowTheWorldFrame)
{
  const Pose pose = randomMotion(11, 1, 2), world = randomMotion(12, 2, 5);
  const Eigen::Vector3d center(0.3, 0.2, 1);
  VisualCorrespondences pairs = randomPairs(pose, 100, 1);
  const VisualSystem here = accumulateVisual(pairs, pose, center, 1);
  for (Eigen::Vector3d& target : pairs.target)
    target = world * target;
  const VisualSystem there = accumulateVisual(pairs, world * pose, world * center, 1);
  const Matrix6d turn = turned(world.linear());
  EXPECT_LT(difference(there.H, Matrix6d(turn * here.H * turn.transpose())), 1e-9);
  EXPECT_LT(difference(there.g, Vector6d(turn * here.g)), 1e-9);
  EXPECT_NEAR(there.cost, here.cost, 1e-9 * here.cost);
}
