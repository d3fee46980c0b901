// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/sparse/bundle_adjustment.h>

#include "sparse/reduced_system.h"

#include <pcl/console/print.h>
#include <pcl/exceptions.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace bundle_icp {
namespace {

// Levenberg and Marquardt's method with the trust region of Madsen, Nielsen and Tingleff, as in Ceres
// Solver, whose constants these are.
constexpr double FIRST_DAMPING = 1e-4;
constexpr double LEAST_DAMPING = 1e-16, LARGEST_DAMPING = 1e32;
constexpr double LEAST_GAIN = 1e-3; ///< of a step that is taken, over what the linear model promised
constexpr double PARAMETER_TOLERANCE = 1e-8;
/** Keeps the normal equations regular where an image has lost all of its observations. */
constexpr double COVARIANCE_DAMPING = 1e-9;

/** Moves `state` to a minimum of the cost. */
template <int SIZE>
BundleAdjustmentResult
minimise(const AdjustmentTerms& terms, const BundleAdjustmentOptions& options, AdjustmentState& state)
{
  BundleAdjustmentResult result;
  result.num_residuals = terms.numResiduals();
  result.final_cost = result.initial_cost = terms.cost(state, options.num_threads);
  result.success = std::isfinite(result.initial_cost);
  if (terms.num_moving == 0 && terms.calibrated.empty())
    return result;
  ReducedSystem<SIZE> system(terms, options.num_threads);
  bool found_step = false;
  double damping = FIRST_DAMPING, growth = 2;
  while (result.success && result.iterations < options.max_iterations) {
    ++result.iterations;
    system.build(state, damping);
    std::optional<AdjustmentStep> step = system.solve(state);
    found_step |= step.has_value();
    const double cost = step ? terms.cost(step->state, options.num_threads) : 0;
    const double decrease = result.final_cost - cost;
    const bool is_settled = step && (step->relative_length < PARAMETER_TOLERANCE ||
                                     std::abs(decrease) < options.function_tolerance * result.final_cost);
    const double gain = step && step->model_decrease > 0 ? decrease / step->model_decrease : -1;
    if (!(gain > LEAST_GAIN)) {
      damping *= growth;
      growth *= 2;
      if (is_settled || damping > LARGEST_DAMPING)
        break;
      continue;
    }
    state = std::move(step->state);
    result.final_cost = cost;
    damping = std::max(damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)), LEAST_DAMPING);
    growth = 2;
    if (is_settled)
      break;
  }
  result.success &= found_step;
  PCL_DEBUG("[bundle_icp::adjustBundle] %zu images, %zu observations: cost %g to %g in %d iterations\n",
            terms.images.size(),
            terms.observations.size(),
            result.initial_cost,
            result.final_cost,
            result.iterations);
  return result;
}

template <int SIZE>
Eigen::MatrixXd
calibrationCovariance(const AdjustmentTerms& terms, const AdjustmentState& state, int num_threads)
{
  ReducedSystem<SIZE> system(terms, num_threads);
  system.build(state, COVARIANCE_DAMPING);
  return system.calibrationCovariance();
}

void
checkOptions(const BundleAdjustmentOptions& options, const char* function)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException(std::string(function) + ": " + error);
}

} // namespace

bool
BundleAdjustmentOptions::isValid(std::string* error) const
{
  const char* reason = max_iterations < 1          ? "max_iterations must be >= 1"
                       : !(loss_scale > 0)         ? "loss_scale must be > 0"
                       : !(function_tolerance > 0) ? "function_tolerance must be > 0"
                                                   : !(depth_error_deviation > 0) ? "depth_error_deviation must be > 0"
                                                   : num_threads < 0 ? "num_threads must be >= 0"
                                                   : nullptr;
  if (reason && error)
    *error = reason;
  return !reason;
}

const CalibrationVector&
calibrationPrior()
{
  static const CalibrationVector prior = [] {
    CalibrationVector p;
    // focal lengths, centre, radial, bias, tilt, shift, readout, time offset
    p << 0.02, 0.02, 5, 5, 0.05, 0.1, 0.01, 0.02, 0.02, 3, 3, 0.03, 0.03;
    return p;
  }();
  return prior;
}

CalibrationVector
calibrationDeviations(const ImageGraph& graph,
                      const BundleAdjustmentProblem& problem,
                      const BundleAdjustmentOptions& options,
                      const SparseModel& model)
{
  checkOptions(options, "calibrationDeviations");
  if (problem.calibrated.empty())
    return CalibrationVector::Zero();
  const AdjustmentTerms terms(graph, problem, options, model);
  const AdjustmentState state = terms.initialState(model);
  const Eigen::MatrixXd covariance =
      (problem.depth_errors ? calibrationCovariance<9> : calibrationCovariance<6>)(
          terms, state, options.num_threads);
  CalibrationVector result = CalibrationVector::Zero();
  for (std::size_t k = 0; k < terms.calibrated.size(); ++k)
    result[terms.calibrated[k]] =
        std::sqrt(std::max(0.0, covariance(Eigen::Index(k), Eigen::Index(k))));
  return result;
}

BundleAdjustmentResult
adjustBundle(const ImageGraph& graph,
             const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options,
             SparseModel& model)
{
  checkOptions(options, "adjustBundle");
  const AdjustmentTerms terms(graph, problem, options, model);
  AdjustmentState state = terms.initialState(model);
  const BundleAdjustmentResult result =
      (problem.depth_errors ? minimise<9> : minimise<6>)(terms, options, state);
  if (result.success)
    terms.writeBack(state, model);
  return result;
}

BundleAdjustmentResult
adjustLocally(const ImageGraph& graph,
              const std::vector<std::size_t>& images,
              std::size_t num_held,
              const BundleAdjustmentOptions& options,
              SparseModel& model)
{
  std::map<std::size_t, std::size_t> shared; // image: points shared with `images`
  for (const std::size_t image : images)
    for (std::size_t j = 0; j < graph.features(image).size(); ++j)
      if (const int point = model.pointOf(image, int(j)); point >= 0)
        for (const Observation& o : model.points()[std::size_t(point)].track)
          ++shared[o.image];
  for (const std::size_t image : images)
    shared.erase(image);
  std::vector<std::pair<std::size_t, std::size_t>> ranked; // by points, then image
  for (const auto& [image, points] : shared)
    ranked.emplace_back(points, image);
  std::sort(ranked.rbegin(), ranked.rend());
  ranked.resize(std::min(ranked.size(), num_held));
  if (ranked.empty())
    return {};
  BundleAdjustmentProblem problem;
  problem.variable = images;
  for (const auto& [points, image] : ranked)
    problem.constant.push_back(image);
  return adjustBundle(graph, problem, options, model);
}

} // namespace bundle_icp
