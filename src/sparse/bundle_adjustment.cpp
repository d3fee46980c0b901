// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/sparse/bundle_adjustment.h>

#include "sparse/held_back.h"
#include "sparse/residuals.h"

#include <pcl/exceptions.h>

#include <Eigen/Dense>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace bundle_icp {
namespace {

/** A DepthResidual with a second row of zeros: where all rows that see points come in twos, Ceres
 *  eliminates points with blocks of fixed size, several times as fast. */
class DepthResidualOfTwoRows
: public ceres::SizedCostFunction<2, 7, 3, NUM_CALIBRATION_PARAMETERS, 3> {
public:
  template <class... Arguments>
  explicit DepthResidualOfTwoRows(const Arguments&... arguments) : residual_(arguments...)
  {
  }

  bool
  Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override
  {
    residuals[1] = 0;
    for (std::size_t block = 0; jacobians && block < parameter_block_sizes().size(); ++block)
      if (jacobians[block]) {
        const int size = parameter_block_sizes()[block];
        std::fill_n(jacobians[block] + size, size, 0.0);
      }
    return residual_.Evaluate(parameters, residuals, jacobians);
  }

private:
  const DepthResidual residual_;
};

/** The Ceres problem of one adjustment, and the parameter blocks that it moves. */
class Adjustment {
public:
  Adjustment(const ImageGraph& graph,
             const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options,
             const SparseModel& model);

  BundleAdjustmentResult
  solve();

  void
  writeBack(SparseModel& model) const;

  CalibrationVector
  deviations();

private:
  void
  addPoses(const BundleAdjustmentProblem& problem);

  void
  addCalibration();

  void
  addObservations();

  void
  addDepthErrors();

  void
  addRelativePoses(const std::vector<RelativePoseTerm>& terms);

  const ImageGraph& graph_;
  const BundleAdjustmentProblem& terms_;
  const BundleAdjustmentOptions& options_;
  const SparseModel& model_;
  // Ceres adds in the order of the blocks' addresses: each kind lies in one array, by index, and is a
  // group of its own, since nobody knows which array comes first.
  std::vector<PoseBlock> poses_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<DepthError> depth_errors_;
  CalibrationVector calibration_;
  std::vector<ImageMeasurement> measurements_;
  std::set<std::size_t> images_;            ///< that take part
  std::vector<std::size_t> moving_points_;
  std::size_t num_zero_rows_ = 0; ///< of DepthResidualOfTwoRows
  ceres::Problem problem_;
};

/** Two blocks share the loss, the manifold and the options: all owned by this problem. */
Adjustment::Adjustment(const ImageGraph& graph,
                       const BundleAdjustmentProblem& problem,
                       const BundleAdjustmentOptions& options,
                       const SparseModel& model)
: graph_(graph)
, terms_(problem)
, options_(options)
, model_(model)
, poses_(model.numImages())
, calibration_(model.calibration().values)
{
  for (const ScenePoint& point : model.points())
    points_.push_back(point.position);
  for (std::size_t image = 0; image < model.numImages(); ++image) {
    depth_errors_.push_back(model.depthError(image));
    measurements_.push_back({graph.camera(), model.motion(image)});
  }
  addPoses(problem);
  addCalibration();
  addObservations();
  addDepthErrors();
  addRelativePoses(problem.relative_poses);
}

void
Adjustment::addPoses(const BundleAdjustmentProblem& problem)
{
  auto* manifold = new PoseManifold;
  const auto add = [&](std::size_t image) {
    if (image >= model_.numImages() || !model_.isRegistered(image))
      throw pcl::BadArgumentException("adjustBundle: image " + std::to_string(image) +
                                      " is not registered");
    if (images_.insert(image).second)
      poses_[image] = PoseBlock(model_.worldFromCamera(image));
    problem_.AddParameterBlock(poses_[image].values, 7, manifold);
    return poses_[image].values;
  };
  for (const std::size_t image : problem.variable)
    add(image);
  for (const std::size_t image : problem.constant)
    problem_.SetParameterBlockConstant(add(image));
  if (problem.constant.empty() && !problem.variable.empty())
    problem_.SetParameterBlockConstant(poses_[problem.variable.front()].values);
}

void
Adjustment::addCalibration()
{
  problem_.AddParameterBlock(calibration_.data(), NUM_CALIBRATION_PARAMETERS);
  if (terms_.calibrated.empty()) {
    problem_.SetParameterBlockConstant(calibration_.data());
    return;
  }
  std::vector<int> held;
  for (int i = 0; i < NUM_CALIBRATION_PARAMETERS; ++i)
    if (std::find(terms_.calibrated.begin(), terms_.calibrated.end(), CalibrationParameter(i)) ==
        terms_.calibrated.end())
      held.push_back(i);
  if (!held.empty())
    problem_.SetManifold(calibration_.data(),
                         new ceres::SubsetManifold(NUM_CALIBRATION_PARAMETERS, held));
  problem_.AddResidualBlock(new PriorResidual(CalibrationVector::Zero(), calibrationPrior()),
                            nullptr,
                            calibration_.data());
}

void
Adjustment::addObservations()
{
  auto* loss = new ceres::CauchyLoss(options_.loss_scale);
  for (std::size_t p = 0; p < model_.points().size(); ++p) {
    const std::vector<Observation> observations =
        observationsThatTakePart(terms_, images_, model_.points()[p]);
    const bool moves = std::any_of(observations.begin(), observations.end(), [this](const Observation& o) {
      return !problem_.IsParameterBlockConstant(poses_[o.image].values);
    });
    if (!moves)
      continue;
    moving_points_.push_back(p);
    double* point = points_[p].data();
    for (const Observation& o : observations) {
      const Features& features = graph_.features(o.image);
      double* pose = poses_[o.image].values;
      problem_.AddResidualBlock(new PixelResidual(measurements_[o.image], features, o.feature),
                                loss,
                                pose,
                                point,
                                calibration_.data());
      if (options_.use_depth && features.hasDepth(o.feature)) {
        ++num_zero_rows_;
        problem_.AddResidualBlock(
            new DepthResidualOfTwoRows(
                measurements_[o.image], model_.depthNoise(), features, o.feature),
            loss,
            pose,
            point,
            calibration_.data(),
            depth_errors_[o.image].data());
      }
    }
  }
}

void
Adjustment::addDepthErrors()
{
  const Eigen::Vector3d deviations = Eigen::Vector3d::Constant(options_.depth_error_deviation);
  for (const std::size_t image : images_) {
    double* error = depth_errors_[image].data();
    if (!problem_.HasParameterBlock(error))
      continue;
    // The image that is held to fix the gauge has errors like any other.
    if (terms_.depth_errors &&
        (terms_.constant.empty() || !problem_.IsParameterBlockConstant(poses_[image].values)))
      problem_.AddResidualBlock(new PriorResidual(Eigen::Vector3d::Zero(), deviations), nullptr, error);
    else
      problem_.SetParameterBlockConstant(error);
  }
}

void
Adjustment::addRelativePoses(const std::vector<RelativePoseTerm>& terms)
{
  for (const RelativePoseTerm& term : terms)
    if (images_.count(term.first) && images_.count(term.second) && term.first != term.second)
      problem_.AddResidualBlock(
          new RelativePoseResidual(term.first_from_second, term.information),
          nullptr,
          poses_[term.first].values,
          poses_[term.second].values);
}

BundleAdjustmentResult
Adjustment::solve()
{
  ceres::Solver::Options options;
  options.max_num_iterations = options_.max_iterations;
  options.function_tolerance = options_.function_tolerance;
  options.linear_solver_type =
      images_.size() < 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const std::size_t p : moving_points_)
    ordering->AddElementToGroup(points_[p].data(), 0);
  for (const std::size_t image : images_) {
    ordering->AddElementToGroup(poses_[image].values, 1);
    if (problem_.HasParameterBlock(depth_errors_[image].data()))
      ordering->AddElementToGroup(depth_errors_[image].data(), 2);
  }
  ordering->AddElementToGroup(calibration_.data(), 3);
  options.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  PCL_DEBUG("[bundle_icp::adjustBundle] %s\n", summary.BriefReport().c_str());
  BundleAdjustmentResult result;
  result.success = summary.IsSolutionUsable();
  result.iterations = int(summary.iterations.size());
  result.num_residuals = std::size_t(summary.num_residuals) - num_zero_rows_;
  result.initial_cost = summary.initial_cost;
  result.final_cost = summary.final_cost;
  return result;
}

void
Adjustment::writeBack(SparseModel& model) const
{
  for (const std::size_t image : images_)
    if (!problem_.IsParameterBlockConstant(poses_[image].values))
      model.setWorldFromCamera(image, poses_[image].worldFromCamera());
  for (const std::size_t image : images_)
    model.setDepthError(image, depth_errors_[image]);
  for (const std::size_t p : moving_points_)
    model.setPosition(p, points_[p]);
  Calibration calibration = model.calibration();
  calibration.values = calibration_;
  model.setCalibration(calibration);
}

/** The calibration's block of the inverse normal matrix is the inverse of its Schur
 *  complement: points go first, one by one, then everything else. */
CalibrationVector
Adjustment::deviations()
{
  ceres::Problem::EvaluateOptions evaluate;
  // Points come first, so that their columns are the leading ones, three by three.
  for (const std::size_t p : moving_points_)
    evaluate.parameter_blocks.push_back(points_[p].data());
  const int points_end = int(3 * moving_points_.size());
  for (const std::size_t image : images_) {
    if (!problem_.IsParameterBlockConstant(poses_[image].values))
      evaluate.parameter_blocks.push_back(poses_[image].values);
    double* error = depth_errors_[image].data();
    if (problem_.HasParameterBlock(error) && !problem_.IsParameterBlockConstant(error))
      evaluate.parameter_blocks.push_back(error);
  }
  evaluate.parameter_blocks.push_back(calibration_.data());
  ceres::CRSMatrix crs;
  problem_.Evaluate(evaluate, nullptr, nullptr, nullptr, &crs);
  using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  const SparseMatrix jacobian = Eigen::Map<const SparseMatrix>(crs.num_rows,
                                                               crs.num_cols,
                                                               int(crs.values.size()),
                                                               crs.rows.data(),
                                                               crs.cols.data(),
                                                               crs.values.data());
  const Eigen::SparseMatrix<double> normal = jacobian.transpose() * jacobian;
  const int rest = crs.num_cols - points_end;
  Eigen::MatrixXd schur = normal.bottomRightCorner(rest, rest);
  for (int p = 0; p < points_end; p += 3) {
    const Eigen::Matrix3d block = normal.block(p, p, 3, 3);
    // Only the few rows of images that see the point
    std::vector<int> rows;
    std::vector<Eigen::Vector3d> values;
    for (int c = 0; c < 3; ++c)
      for (Eigen::SparseMatrix<double>::InnerIterator it(normal, p + c); it; ++it)
        if (it.row() >= points_end) {
          const int row = int(it.row()) - points_end;
          auto found = std::find(rows.begin(), rows.end(), row);
          if (found == rows.end()) {
            rows.push_back(row);
            values.push_back(Eigen::Vector3d::Zero());
            found = rows.end() - 1;
          }
          values[std::size_t(found - rows.begin())][c] = it.value();
        }
    const Eigen::Matrix3d inverse = block.inverse();
    for (std::size_t a = 0; a < rows.size(); ++a) {
      const Eigen::Vector3d weighted = inverse * values[a];
      for (std::size_t b = 0; b < rows.size(); ++b)
        schur(rows[a], rows[b]) -= weighted.dot(values[b]);
    }
  }
  const int count = int(terms_.calibrated.size());
  const Eigen::MatrixXd covariance =
      schur.ldlt().solve(Eigen::MatrixXd::Identity(rest, rest).rightCols(count)).bottomRows(count);
  CalibrationVector result = CalibrationVector::Zero();
  std::vector<CalibrationParameter> sorted = terms_.calibrated;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < count; ++i)
    result[int(sorted[std::size_t(i)])] = std::sqrt(std::max(0.0, covariance(i, i)));
  return result;
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
  return Adjustment(graph, problem, options, model).deviations();
}

BundleAdjustmentResult
adjustBundle(const ImageGraph& graph,
             const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options,
             SparseModel& model)
{
  checkOptions(options, "adjustBundle");
  Adjustment adjustment(graph, problem, options, model);
  const BundleAdjustmentResult result = adjustment.solve();
  if (result.success)
    adjustment.writeBack(model);
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
