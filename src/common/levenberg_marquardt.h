// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace bundle_icp {

/** A step of a damped least-squares problem. */
template <class State>
struct LeastSquaresStep {
  State state;                ///< after the step
  double model_decrease = 0;  ///< decrease of the cost, if residuals were linear
  double relative_length = 0; ///< of the step, over that of the unknowns
};

/** Outcome of minimise(). */
struct LeastSquaresResult {
  bool success = false; ///< the cost was finite, and a step could be computed
  int iterations = 0;
  double initial_cost = 0;
  double final_cost = 0;
};

/** The entry that `damping` multiplies. As in Ceres Solver it never vanishes, and is measured where
 *  columns are scaled to about unit length. */
inline double
dampedPart(double diagonal)
{
  const double scale = 1 + std::sqrt(diagonal);
  return std::max(diagonal, 1e-6 * scale * scale);
}

/** Moves `state` to a minimum of half the sum of squared residuals: Levenberg and Marquardt's
 *  method with the trust region of Madsen, Nielsen and Tingleff, as in Ceres Solver, whose
 *  constants these are.
 *
 *  A problem has
 *  - double cost(const State&);
 *  - void build(const State&, double damping): its normal equations there, with `damping` times the
 *    dampedPart() of the diagonal added to it;
 *  - std::optional<LeastSquaresStep<State>> solve(const State&): unset when these are not positive
 *    definite.
 *  \param function_tolerance stops when an iteration changes the cost by less than this share */
template <class Problem, class State>
LeastSquaresResult
minimise(Problem& problem, int max_iterations, double function_tolerance, State& state)
{
  constexpr double least_damping = 1e-16, largest_damping = 1e32;
  constexpr double least_gain =
      1e-3; // of a step that is taken, over what the linear model promised
  constexpr double parameter_tolerance = 1e-8;
  LeastSquaresResult result;
  result.final_cost = result.initial_cost = problem.cost(state);
  const bool is_finite = std::isfinite(result.initial_cost);
  double damping = 1e-4, growth = 2;
  while (is_finite && result.iterations < max_iterations) {
    ++result.iterations;
    problem.build(state, damping);
    std::optional<LeastSquaresStep<State>> step = problem.solve(state);
    result.success |= step.has_value();
    const double cost = step ? problem.cost(step->state) : 0;
    const double decrease = result.final_cost - cost;
    const bool is_settled = step && (step->relative_length < parameter_tolerance ||
                                     std::abs(decrease) < function_tolerance * result.final_cost);
    const double gain = step && step->model_decrease > 0 ? decrease / step->model_decrease : -1;
    if (gain > least_gain) {
      state = std::move(step->state);
      result.final_cost = cost;
      damping = std::max(damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)), least_damping);
      growth = 2;
    }
    else {
      damping *= growth;
      growth *= 2;
    }
    if (is_settled || damping > largest_damping)
      break;
  }
  return result;
}

} // namespace bundle_icp
