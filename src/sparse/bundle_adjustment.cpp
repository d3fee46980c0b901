// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/sparse/bundle_adjustment.h>

#include "sparse/residuals.h"

#include <pcl/exceptions.h>

#include <algorithm>
#include <map>

#include <set>

namespace bundle_icp {
namespace {

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

private:
  void
  addPoses(const BundleAdjustmentProblem& problem);

  void
  addObservations();

  void
  addRelativePoses(const std::vector<RelativePoseTerm>& terms);

  const ImageGraph& graph_;
  const BundleAdjustmentOptions& options_;
  const SparseModel& model_;
  // Ceres adds in the order of the blocks' addresses: each kind lies in one array, by index.
  std::vector<PoseBlock> poses_;
  std::vector<Eigen::Vector3d> points_;
  std::set<std::size_t> images_;            ///< that take part
  std::vector<std::size_t> moving_points_;
  ceres::Problem problem_;
};

/** Two blocks share the loss, the manifold and the options: all owned by this problem. */
Adjustment::Adjustment(const ImageGraph& graph,
                       const BundleAdjustmentProblem& problem,
                       const BundleAdjustmentOptions& options,
                       const SparseModel& model)
: graph_(graph), options_(options), model_(model), poses_(model.numImages())
{
  for (const ScenePoint& point : model.points())
    points_.push_back(point.position);
  addPoses(problem);
  addObservations();
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
Adjustment::addObservations()
{
  auto* loss = new ceres::CauchyLoss(options_.loss_scale);
  for (std::size_t p = 0; p < model_.points().size(); ++p) {
    std::vector<Observation> observations;
    bool moves = false;
    for (const Observation& o : model_.points()[p].track)
      if (images_.count(o.image)) {
        observations.push_back(o);
        moves |= !problem_.IsParameterBlockConstant(poses_[o.image].values);
      }
    if (!moves || observations.size() < 2)
      continue;
    moving_points_.push_back(p);
    double* point = points_[p].data();
    for (const Observation& o : observations) {
      const Features& features = graph_.features(o.image);
      double* pose = poses_[o.image].values;
      problem_.AddResidualBlock(new PixelResidual(graph_.camera(),
                                                  features.pixels[o.feature].cast<double>(),
                                                  features.pixel_sigmas[o.feature]),
                                loss,
                                pose,
                                point);
      if (options_.use_depth && features.hasDepth(o.feature))
        problem_.AddResidualBlock(
            new DepthResidual(features.depths[o.feature], features.depth_sigmas[o.feature]),
            loss,
            pose,
            point);
    }
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
  for (const std::size_t image : images_)
    ordering->AddElementToGroup(poses_[image].values, 1);
  options.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  PCL_DEBUG("[bundle_icp::adjustBundle] %s\n", summary.BriefReport().c_str());
  BundleAdjustmentResult result;
  result.success = summary.IsSolutionUsable();
  result.iterations = int(summary.iterations.size());
  result.num_residuals = std::size_t(summary.num_residuals);
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
  for (const std::size_t p : moving_points_)
    model.setPosition(p, points_[p]);
}

} // namespace

bool
BundleAdjustmentOptions::isValid(std::string* error) const
{
  const char* reason = max_iterations < 1          ? "max_iterations must be >= 1"
                       : !(loss_scale > 0)         ? "loss_scale must be > 0"
                       : !(function_tolerance > 0) ? "function_tolerance must be > 0"
                                                   : nullptr;
  if (reason && error)
    *error = reason;
  return !reason;
}

BundleAdjustmentResult
adjustBundle(const ImageGraph& graph,
             const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options,
             SparseModel& model)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException("adjustBundle: " + error);
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
