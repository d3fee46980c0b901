// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Which motions surfaces hold, the step along these, and how well a pose is known.
#include "made_matches.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** Samples of a surface about the centre, whose residuals are those after a motion. */
template <typename Sample>
DenseSystem
surface(const Sample& sample, const Vector6d& motion = Vector6d::Zero())
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<MadeMatch> made;
  for (int i = 0; i < 4000; ++i) {
    const double u = uniform(random), v = uniform(random);
    const auto [point, normal] = sample(i, u, v);
    MadeMatch match{point, normal};
    match.residual = normal.dot(motion.head<3>().cross(point) + motion.tail<3>());
    made.push_back(match);
  }
  return accumulate(toMatches(made), 1, 1);
}

using Surfel = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

Surfel
onPlane(int, double u, double v)
{
  return {{u, v, 0}, Eigen::Vector3d::UnitZ()};
}

Surfel
onSphere(int, double u, double v)
{
  const double ring = std::sqrt(1 - v * v);
  const Eigen::Vector3d normal(ring * std::cos(M_PI * u), ring * std::sin(M_PI * u), v);
  return {normal, normal};
}

/** With the axis along z. */
Surfel
onCylinder(int, double u, double v)
{
  const Eigen::Vector3d normal(std::cos(M_PI * u), std::sin(M_PI * u), 0);
  return {normal + v * Eigen::Vector3d::UnitZ(), normal};
}

Surfel
onCorner(int i, double u, double v)
{
  const Eigen::Vector3d normal = Eigen::Vector3d::Unit(i % 3);
  return {u * Eigen::Vector3d::Unit((i + 1) % 3) + v * Eigen::Vector3d::Unit((i + 2) % 3) - normal,
          normal};
}

/** Share of a unit motion that lies in the span of the degenerate directions. */
double
shareInSpan(const Vector6d& motion, const std::vector<Vector6d>& directions)
{
  Eigen::MatrixXd span(6, directions.size());
  for (std::size_t k = 0; k < directions.size(); ++k)
    span.col(Eigen::Index(k)) = directions[k];
  const Eigen::MatrixXd q =
      span.householderQr().householderQ() * Eigen::MatrixXd::Identity(6, span.cols());
  return (q.transpose() * motion).norm();
}

Vector6d
smallMotion()
{
  Vector6d motion;
  motion << 1e-4, -2e-4, 3e-4, 4e-4, -3e-4, 2e-4;
  return motion;
}

} // namespace

TEST(Observability, OpenDirectionsAreTheSymmetriesOfTheSurface)
{
  const auto expectOpen = [](const DenseSystem& system, const std::vector<int>& axes) {
    const Step step = solve(system, 1, {}, {});
    ASSERT_EQ(step.degenerate.size(), axes.size());
    for (const int axis : axes)
      EXPECT_NEAR(shareInSpan(Vector6d::Unit(axis), step.degenerate), 1, 1e-3) << axis;
    for (const Vector6d& direction : step.degenerate)
      EXPECT_NEAR(direction.norm(), 1, 1e-12);
  };
  expectOpen(surface(onPlane), {2, 3, 4});  // turning and sliding in it
  expectOpen(surface(onSphere), {0, 1, 2}); // turning about its centre
  expectOpen(surface(onCylinder), {2, 5});  // turning about its axis and sliding along it
  expectOpen(surface(onCorner), {});
}

TEST(Observability, StepUndoesTheHeldPartOfAMotionAndLeavesTheRest)
{
  const Vector6d motion = smallMotion();
  const Step corner = solve(surface(onCorner, motion), 1, {}, {});
  EXPECT_LT(difference(corner.delta, Vector6d(-motion)), 0.01);
  EXPECT_LT(difference(corner.dense_delta, Vector6d(-motion)), 0.01);

  const Step plane = solve(surface(onPlane, motion), 1, {}, {});
  for (const int open : {2, 3, 4})
    EXPECT_NEAR(plane.delta[open], 0, 1e-6) << open;
  for (const int held : {0, 1, 5})
    EXPECT_NEAR(plane.delta[held], -motion[held], 1e-5) << held;
}

TEST(Observability, VisualEvidenceDecidesAlongOpenDirections)
{
  // Surfaces and correspondences ask for different motions of a plane.
  const Vector6d dense_motion = smallMotion(), visual_motion = -3 * smallMotion();
  VisualSystem visual;
  visual.H = 100 * Matrix6d::Identity(); // weak beside the surface
  visual.g = visual.H * visual_motion;
  const Step step = solve(surface(onPlane, dense_motion), 1, visual, {});
  for (const int open : {2, 3, 4}) {
    EXPECT_NEAR(step.delta[open], -visual_motion[open], 1e-6) << open;
    EXPECT_NEAR(step.dense_delta[open], 0, 1e-6) << "without visual evidence";
  }
  for (const int held : {0, 1, 5})
    EXPECT_NEAR(step.delta[held], -dense_motion[held], 2e-5) << held;
}

TEST(Observability, EvidenceOfBothKindsIsWeighedByItsInformation)
{
  const Vector6d dense_motion = smallMotion(), visual_motion = Vector6d::Zero();
  const DenseSystem dense = surface(onCorner, dense_motion);
  VisualSystem visual;
  visual.H = dense.H / 4;
  visual.g = visual.H * visual_motion;
  // The dense terms overstate their information fourfold: both then count the same.
  const Step step = solve(dense, 4, visual, {});
  EXPECT_LT(difference(step.delta, Vector6d(-dense_motion / 2)), 0.01);
}

TEST(Observability, OverstatedInformationIsDividedAndMovesNothing)
{
  const DenseSystem system = surface(onCorner, smallMotion());
  const Step plain = solve(system, 1, {}, {}), careful = solve(system, 81, {}, {});
  EXPECT_LT(difference(plain.information, system.H), 1e-5);
  EXPECT_LT(difference(Matrix6d(81 * careful.information), plain.information), 1e-9);
  EXPECT_LT(difference(careful.delta, plain.delta), 1e-9);
}

TEST(Observability, LengthOfTheSourceComparesTurnsToTranslations)
{
  // A corner seen from afar: the same angles, a hundredth of the size. With its length the verdict
  // is that of the large one; with a metre its turns would count as open.
  const auto small = [](int i, double u, double v) {
    const Surfel surfel = onCorner(i, u, v);
    return Surfel(0.01 * surfel.first, surfel.second);
  };
  Observability observability;
  EXPECT_EQ(solve(surface(small), 1, {}, observability).degenerate.size(), 3u);
  observability.length = 0.01;
  EXPECT_TRUE(solve(surface(small), 1, {}, observability).degenerate.empty());
}

TEST(Observability, ADirectionKnownTooPoorlyIsOpen)
{
  const DenseSystem system = surface(onCorner);
  const double deviation =
      1 / std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix6d>(system.structure).eigenvalues()[0]);
  Observability observability;
  observability.max_deviation = 1.01 * deviation;
  EXPECT_TRUE(solve(system, 1, {}, observability).degenerate.empty());
  EXPECT_FALSE(solve(system, 1.05, {}, observability).degenerate.empty());
}

TEST(Observability, WhileMisalignedTheTargetsNormalsAloneTellWhatHolds)
{
  DenseSystem system = surface(onCorner, smallMotion());
  system.structure.setZero(); // as of source normals from other places
  Observability observability;
  EXPECT_EQ(solve(system, 1, {}, observability).degenerate.size(), 6u);
  EXPECT_EQ(solve(system, 1, {}, observability).delta, Vector6d::Zero());
  observability.misaligned = true;
  const Step step = solve(system, 1, {}, observability);
  EXPECT_TRUE(step.degenerate.empty());
  EXPECT_LT(difference(step.delta, Vector6d(-smallMotion())), 0.01);
}

TEST(Observability, FollowsTheFrame)
{
  const Eigen::Matrix3d rotation = randomMotion(2, 1.2, 0).linear();
  const auto inTurned = [&](int i, double u, double v) {
    const Surfel surfel = onCylinder(i, u, v);
    return Surfel(rotation * surfel.first, rotation * surfel.second);
  };
  const Vector6d motion = smallMotion(), in_turned = turned(rotation) * motion;
  const Step here = solve(surface(onCylinder, motion), 1, {}, {});
  const Step there = solve(surface(inTurned, in_turned), 1, {}, {});
  EXPECT_LT(difference(there.delta, Vector6d(turned(rotation) * here.delta)), 1e-3);
  ASSERT_EQ(there.degenerate.size(), 2u);
  for (const Vector6d& direction : here.degenerate)
    EXPECT_NEAR(shareInSpan(turned(rotation) * direction, there.degenerate), 1, 1e-3);
}
