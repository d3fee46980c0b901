// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/adjustment/bundle_adjustment.h>

#include "adjustment/held_back.h"
#include "adjustment/reduced_system.h"

#include <bundle_icp/common/exceptions.h>

#include <ceres/normal_prior.h>
#include <pcl/console/print.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace bundle_icp {
namespace {

/** Ceres' dense solver is faster up to so many frames. */
constexpr std::size_t MAX_DENSE = 60;
/** Keeps the normal equations regular where a frame has lost all of its observations. */
constexpr double COVARIANCE_DAMPING = 1e-9;

ceres::NormalPrior
zeroPrior(const Eigen::VectorXd& deviations)
{
  return {deviations.cwiseInverse().asDiagonal().toDenseMatrix(),
          Eigen::VectorXd::Zero(deviations.size())};
}

/** The terms in the form of Ceres. Its solution moves `state` in place. */
class CeresProblem {
public:
  CeresProblem(const AdjustmentTerms& terms, double loss_scale, AdjustmentState& state)
  : terms_(terms), state_(state), loss_(loss_scale),
    depth_error_prior_(zeroPrior(Eigen::Vector3d::Constant(terms.depthErrorDeviation()))),
    calibration_prior_(zeroPrior(calibrationPrior())), problem_(options())
  {
    addResiduals();
    addFrames();
    addCalibration();
  }

  LeastSquaresResult
  solve(const BundleAdjustmentOptions& options);

private:
  /** The residuals belong to the terms, and what they share to this. */
  static ceres::Problem::Options
  options()
  {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  void
  addResiduals();
  void
  addFrames();
  void
  addCalibration();

  const AdjustmentTerms& terms_;
  AdjustmentState& state_;
  ceres::CauchyLoss loss_;
  PoseManifold pose_manifold_;
  std::unique_ptr<ceres::Manifold> calibration_manifold_;
  ceres::NormalPrior depth_error_prior_, calibration_prior_;
  ceres::Problem problem_;
};

void
CeresProblem::addResiduals()
{
  double* const calibration = state_.calibration.data();
  for (const AdjustedObservation& o : terms_.observations) {
    double* const pose = state_.poses[std::size_t(o.frame)].values;
    double* const point = state_.points[std::size_t(o.point)].data();
    double* const depth_error = state_.depth_errors[std::size_t(o.frame)].data();
    problem_.AddResidualBlock(o.residuals.pixel.get(), &loss_, pose, point, calibration);
    if (o.residuals.depth)
      problem_.AddResidualBlock(o.residuals.depth.get(), &loss_, pose, point, calibration,
                                depth_error);
  }
  for (const AdjustedPair& pair : terms_.pairs)
    problem_.AddResidualBlock(pair.residual.get(), nullptr,
                              state_.poses[std::size_t(pair.first)].values,
                              state_.poses[std::size_t(pair.second)].values);
}

void
CeresProblem::addFrames()
{
  for (std::size_t i = 0; i < terms_.frames.size(); ++i) {
    double* const pose = state_.poses[i].values;
    double* const depth_error = state_.depth_errors[i].data();
    problem_.AddParameterBlock(pose, 7, &pose_manifold_);
    problem_.AddParameterBlock(depth_error, 3);
    if (!terms_.frames[i].pose_moves)
      problem_.SetParameterBlockConstant(pose);
    if (terms_.frames[i].depth_error_moves)
      problem_.AddResidualBlock(&depth_error_prior_, nullptr, depth_error);
    else
      problem_.SetParameterBlockConstant(depth_error);
  }
}

void
CeresProblem::addCalibration()
{
  double* const calibration = state_.calibration.data();
  problem_.AddParameterBlock(calibration, NUM_CALIBRATION_PARAMETERS);
  if (terms_.calibrated.empty()) {
    problem_.SetParameterBlockConstant(calibration);
    return;
  }
  problem_.AddResidualBlock(&calibration_prior_, nullptr, calibration);
  std::vector<int> held;
  for (int k = 0; k < NUM_CALIBRATION_PARAMETERS; ++k)
    if (!std::binary_search(terms_.calibrated.begin(), terms_.calibrated.end(), k))
      held.push_back(k);
  calibration_manifold_ = std::make_unique<ceres::SubsetManifold>(NUM_CALIBRATION_PARAMETERS, held);
  problem_.SetManifold(calibration, calibration_manifold_.get());
}

/** By one thread, and with Eigen's factorisations: no BLAS, and the same result each time. */
LeastSquaresResult
CeresProblem::solve(const BundleAdjustmentOptions& options)
{
  ceres::Solver::Options solver;
  solver.linear_solver_type =
      terms_.num_moving <= MAX_DENSE ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver.dense_linear_algebra_library_type = ceres::EIGEN;
  solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  // Points are eliminated first. Ceres orders the blocks of a group by their addresses, which
  // repeat themselves within an array only: each is a group.
  ceres::ParameterBlockOrdering ordering;
  for (Eigen::Vector3d& point : state_.points)
    ordering.AddElementToGroup(point.data(), 0);
  for (PoseBlock& pose : state_.poses)
    ordering.AddElementToGroup(pose.values, 1);
  for (DepthError& depth_error : state_.depth_errors)
    ordering.AddElementToGroup(depth_error.data(), 2);
  ordering.AddElementToGroup(state_.calibration.data(), 3);
  solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>(ordering);
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.function_tolerance;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem_, &summary);
  return {summary.IsSolutionUsable(), int(summary.iterations.size()) - 1, summary.initial_cost,
          summary.final_cost};
}

/** The library's own solver. */
template <int SIZE>
LeastSquaresResult
solveBySchur(const AdjustmentTerms& terms, const BundleAdjustmentOptions& options,
             AdjustmentState& state)
{
  ReducedSystem<SIZE> system(terms, options.num_threads);
  return minimise(system, options.max_iterations, options.function_tolerance, state);
}

LeastSquaresResult
solve(const AdjustmentTerms& terms, const BundleAdjustmentOptions& options, AdjustmentState& state)
{
  if (terms.num_moving == 0 && terms.calibrated.empty()) {
    const double cost = terms.cost(state, options.num_threads);
    return {std::isfinite(cost), 0, cost, cost};
  }
  if (options.solver == AdjustmentSolver::CERES)
    return CeresProblem(terms, options.loss_scale, state).solve(options);
  const bool depth_errors = terms.frames.size() > 0 && terms.frames.front().depth_error_moves;
  return (depth_errors ? solveBySchur<9> : solveBySchur<6>)(terms, options, state);
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
    throw BadArgumentException(std::string(function) + ": " + error);
}

} // namespace

bool
BundleAdjustmentOptions::isValid(std::string* error) const
{
  const char* reason = max_iterations < 1             ? "max_iterations must be >= 1"
                       : !(loss_scale > 0)            ? "loss_scale must be > 0"
                       : !(function_tolerance > 0)    ? "function_tolerance must be > 0"
                       : !(depth_error_deviation > 0) ? "depth_error_deviation must be > 0"
                       : num_threads < 0              ? "num_threads must be >= 0"
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
calibrationDeviations(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                      const BundleAdjustmentOptions& options, const SparseModel& model)
{
  checkOptions(options, "calibrationDeviations");
  if (problem.calibrated.empty())
    return CalibrationVector::Zero();
  const AdjustmentTerms terms(graph, problem, options, model);
  const AdjustmentState state = terms.initialState(model);
  const Eigen::MatrixXd covariance =
      (problem.depth_errors ? calibrationCovariance<9>
                            : calibrationCovariance<6>)(terms, state, options.num_threads);
  CalibrationVector result = CalibrationVector::Zero();
  for (std::size_t k = 0; k < terms.calibrated.size(); ++k)
    result[terms.calibrated[k]] =
        std::sqrt(std::max(0.0, covariance(Eigen::Index(k), Eigen::Index(k))));
  return result;
}

BundleAdjustmentResult
adjustBundle(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options, SparseModel& model)
{
  checkOptions(options, "adjustBundle");
  const AdjustmentTerms terms(graph, problem, options, model);
  AdjustmentState state = terms.initialState(model);
  const LeastSquaresResult solved = solve(terms, options, state);
  if (solved.success)
    terms.writeBack(state, model);
  PCL_DEBUG(
      "[bundle_icp::adjustBundle] %zu images, %zu observations: cost %g to %g in %d iterations\n",
      terms.frames.size(), terms.observations.size(), solved.initial_cost, solved.final_cost,
      solved.iterations);
  return {solved.success, solved.iterations, terms.numResiduals(), solved.initial_cost,
          solved.final_cost};
}

BundleAdjustmentResult
adjustLocally(const ImageGraph& graph, const std::vector<std::size_t>& frames, std::size_t num_held,
              const BundleAdjustmentOptions& options, SparseModel& model)
{
  std::map<std::size_t, std::size_t> shared; // frame: points shared with `frames`
  for (const std::size_t frame : frames)
    for (std::size_t j = 0; j < graph.features(frame).size(); ++j)
      if (const int point = model.pointOf(frame, int(j)); point >= 0)
        for (const Observation& o : model.points()[std::size_t(point)].track)
          ++shared[o.frame];
  for (const std::size_t frame : frames)
    shared.erase(frame);
  std::vector<std::pair<std::size_t, std::size_t>> ranked; // by points, then frame
  for (const auto& [frame, points] : shared)
    ranked.emplace_back(points, frame);
  std::sort(ranked.rbegin(), ranked.rend());
  ranked.resize(std::min(ranked.size(), num_held));
  if (ranked.empty())
    return {};
  BundleAdjustmentProblem problem;
  problem.variable = frames;
  for (const auto& [points, frame] : ranked)
    problem.constant.push_back(frame);
  return adjustBundle(graph, problem, options, model);
}

} // namespace bundle_icp
