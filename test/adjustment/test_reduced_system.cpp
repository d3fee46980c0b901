// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/reduced_system.h"

#include "adjustment/dense_system.h"
#include "adjustment/landmark_scene.h"
#include "variants.h"

#include <cmath>
#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double DAMPING = 1e-3;

/** A scene with its terms, away from the minimum: weights of the robust loss are not 1. */
struct System {
  NoisyScene scene;
  BundleAdjustmentOptions options;
  AdjustmentTerms terms;
  AdjustmentState state;

  explicit System(void (*change)(NoisyScene&))
  : scene(changed(change)), terms(scene.graph, scene.problem, options, scene.model),
    state(terms.initialState(scene.model))
  {
    for (std::size_t i = 0; i < terms.num_moving; ++i) // priors pull, too
      if (terms.frames[i].depth_error_moves)
        state.depth_errors[i] = DepthError(0.5, -0.3, 0.2) * double(i + 1);
    for (const int parameter : terms.calibrated)
      state.calibration[parameter] = 0.3 * calibrationPrior()[parameter];
  }

  static NoisyScene
  changed(void (*change)(NoisyScene&))
  {
    NoisyScene scene(5);
    change(scene);
    return scene;
  }
};

double
difference(const AdjustmentState& a, const AdjustmentState& b)
{
  double largest = (a.calibration - b.calibration).cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    for (int k = 0; k < 7; ++k)
      largest = std::max(largest, std::abs(a.poses[i].values[k] - b.poses[i].values[k]));
    largest = std::max(largest, (a.depth_errors[i] - b.depth_errors[i]).norm());
  }
  for (std::size_t p = 0; p < a.points.size(); ++p)
    largest = std::max(largest, (a.points[p] - b.points[p]).norm());
  return largest;
}

/** Squared length of all that moves, as parameters: that of poses includes their quaternions. */
double
squaredLength(const System& system)
{
  double sum = system.state.calibration.squaredNorm();
  for (const Eigen::Vector3d& point : system.state.points)
    sum += point.squaredNorm();
  for (std::size_t i = 0; i < system.terms.num_moving; ++i)
    for (const double value : system.state.poses[i].values)
      sum += value * value;
  return sum;
}

template <int SIZE>
void
expectStepOfTheDenseSystem(const System& system, double damping)
{
  ReducedSystem<SIZE> reduced(system.terms, 2);
  reduced.build(system.state, damping);
  const auto step = reduced.solve(system.state);
  ASSERT_TRUE(step);
  const DenseSystem<SIZE> dense(system.terms, system.state, damping);
  const Eigen::VectorXd expected = dense.step();
  ASSERT_GT(expected.norm(), 1e-3);
  EXPECT_LT(difference(step->state, dense.moved(system.terms, system.state, expected)), 1e-8);
  // What the linear model promises, from its residuals after the step
  const double decrease =
      dense.residual.squaredNorm() - (dense.residual + dense.jacobian * expected).squaredNorm();
  EXPECT_NEAR(step->model_decrease, decrease / 2, 1e-7 * decrease);
  EXPECT_NEAR(step->relative_length, expected.norm() / std::sqrt(squaredLength(system)), 1e-8);
  const Eigen::MatrixXd information = dense.hessian() + Eigen::MatrixXd(dense.damping.asDiagonal());
  const Eigen::Index first = SIZE * dense.num_frames, m = dense.num_calibrated;
  const Eigen::MatrixXd covariance = information.inverse().block(first, first, m, m);
  EXPECT_LE((reduced.calibrationCovariance() - covariance).norm(), 1e-6 * covariance.norm());
}

using Change = void (*)(NoisyScene&);

void
unchanged(NoisyScene&)
{
}

void
withDepthErrors(NoisyScene& scene)
{
  scene.problem.depth_errors = true;
}

void
withConstantImages(NoisyScene& scene)
{
  scene.problem.variable = {4, 1, 3};
  scene.problem.constant = {2, 0};
}

void
withPairsAndCalibration(NoisyScene& scene)
{
  complicate(scene);
  scene.problem.depth_errors = false;
}

void
blind(NoisyScene& scene)
{
  scene.model = SparseModel(scene.views.size());
  for (const std::size_t i : {0, 1, 3, 4})
    scene.model.registerFrame(scene.graph, i, scene.views[i].world_from_camera, 0, {});
  scene.model.registerFrame(2, scene.views[2].world_from_camera, 0); // without tracks
  scene.perturb();
  scene.problem.calibrated = {CalibrationParameter::CENTER_X};
}

} // namespace

TEST(ReducedSystem, TakesTheStepOfTheDenseSystem)
{
  for (const Change change : {unchanged, withConstantImages, withPairsAndCalibration})
    for (const double damping : {0.0, DAMPING, 10.0})
      expectStepOfTheDenseSystem<6>(System(change), damping);
}

TEST(ReducedSystem, TakesTheStepOfTheDenseSystemWithDepthErrors)
{
  // In complicate() the first frame is held by the gauge, but not its depth error.
  for (const Change change : {withDepthErrors, Change(complicate)})
    for (const double damping : {0.0, DAMPING})
      expectStepOfTheDenseSystem<9>(System(change), damping);
}

TEST(ReducedSystem, CostsWhatItsTermsCost)
{
  const System system(complicate);
  EXPECT_EQ(ReducedSystem<9>(system.terms, 2).cost(system.state),
            system.terms.cost(system.state, 1));
}

TEST(ReducedSystem, ItsModelForetellsTheCostOfASmallStep)
{
  // Near the minimum of exact residuals the problem is as good as linear.
  LandmarkScene scene;
  for (std::size_t i = 1; i < scene.views.size(); ++i)
    scene.model.setWorldFromCamera(i,
                                   randomMotion(i, 1e-4, 1e-4) * scene.views[i].world_from_camera);
  const BundleAdjustmentOptions options;
  const AdjustmentTerms terms(scene.graph, scene.problem, options, scene.model);
  const AdjustmentState state = terms.initialState(scene.model);
  ReducedSystem<6> system(terms, 2);
  system.build(state, DAMPING);
  const auto step = system.solve(state);
  ASSERT_TRUE(step);
  const double decrease = system.cost(state) - system.cost(step->state);
  EXPECT_GT(decrease, 0.9 * system.cost(state));
  EXPECT_NEAR(step->model_decrease / decrease, 1, 0.02);
}

TEST(ReducedSystem, MoreDampingMeansAShorterStep)
{
  const System system(complicate);
  ReducedSystem<9> reduced(system.terms, 2);
  double last = std::numeric_limits<double>::infinity();
  for (const double damping : {1e-6, 1e-2, 1.0, 100.0}) { // the same system is built again
    reduced.build(system.state, damping);
    const auto step = reduced.solve(system.state);
    ASSERT_TRUE(step);
    EXPECT_LT(step->relative_length, last);
    last = step->relative_length;
  }
}

TEST(ReducedSystem, IsTheSameForAnyThreadsAndSimdVariant)
{
  const System system(complicate);
  std::optional<LeastSquaresStep<AdjustmentState>> first;
  forEachVariant([&] {
    for (const int num_threads : {1, 2, 3}) {
      ReducedSystem<9> reduced(system.terms, num_threads);
      reduced.build(system.state, DAMPING);
      const auto step = reduced.solve(system.state);
      ASSERT_TRUE(step);
      if (!first)
        first = step;
      EXPECT_EQ(difference(step->state, first->state), 0);
      EXPECT_EQ(step->model_decrease, first->model_decrease);
      EXPECT_EQ(step->relative_length, first->relative_length);
    }
  });
}

TEST(ReducedSystem, HasNoSolutionWhereAnImageIsFree)
{
  const System system(blind);
  ReducedSystem<6> reduced(system.terms, 2);
  reduced.build(system.state, 0);
  EXPECT_FALSE(reduced.solve(system.state));
  EXPECT_EQ(reduced.calibrationCovariance()(0, 0), std::numeric_limits<double>::infinity());
  reduced.build(system.state, DAMPING); // which leaves the frame where it is
  const auto step = reduced.solve(system.state);
  ASSERT_TRUE(step);
  EXPECT_TRUE(std::isfinite(reduced.calibrationCovariance()(0, 0)));
  for (std::size_t i = 0; i < system.terms.num_moving; ++i) {
    const double* const before = system.state.poses[i].values;
    const double* const after = step->state.poses[i].values;
    double moved = 0;
    for (int k = 0; k < 7; ++k)
      moved = std::max(moved, std::abs(after[k] - before[k]));
    if (system.terms.frames[i].frame == 2)
      EXPECT_LT(moved, 1e-15);
    else
      EXPECT_GT(moved, 1e-6);
  }
}

TEST(ReducedSystem, HasNoStepFromAStateThatIsNotFinite)
{
  System system(unchanged);
  system.state.points[3].x() = std::numeric_limits<double>::quiet_NaN();
  ReducedSystem<6> reduced(system.terms, 2);
  reduced.build(system.state, DAMPING);
  EXPECT_FALSE(reduced.solve(system.state));
}
