// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/alignment_terms.h"

#include <pcl/console/print.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace bundle_icp {
namespace {

/** Largest distance of a projective match on the coarse levels and the last one [m]. */
constexpr float COARSE_DISTANCE = 0.4f, LAST_DISTANCE = 0.15f;
/** With nearest neighbours, whose unit of length is unknown, the noise that a level takes for
 * granted is a share of the root mean square distance. */
constexpr double LEVEL_RMS_SHARE[] = {1, 0.3, 0};
/** Observed noise counts as at least this share of the model's: residuals of exact data
 * must not declare every curvature an outlier. */
constexpr double MIN_SCALE = 0.25;
/** The virtual depth is rendered anew when the pose has moved further than this. */
constexpr double RENDER_DISTANCE = 0.02, RENDER_ANGLE = 2 * M_PI / 180;
constexpr int MAX_RENDERINGS = 4;
/** A direction of projective association that is known no better than this is not held
 * [m]. */
constexpr double MAX_DEVIATION = 0.02;

/** What is no unit normal counts as none. */
AlignmentProblem
withUnitNormals(const AlignmentProblem& problem)
{
  AlignmentProblem usable = problem;
  if (!hasUnitNormals(usable.source))
    usable.source.normals = nullptr;
  if (!hasUnitNormals(usable.target))
    usable.target.normals = nullptr;
  return usable;
}

/** Gradients of the dense terms, summed over tiles of the image: neighbouring pixels share errors,
 * of the camera and of the surface that they are compared with. */
std::vector<Vector6d>
tileGradients(const SourcePoints& source, int width, const Matches& matches, double scale)
{
  constexpr int SIDE = 16; // samples; errors reach less far
  const int side = SIDE * source.stride;
  std::map<int, Vector6d> tiles;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const double inverse = matches.inverse_sigma[i], e = matches.residual[i] * inverse;
    const double weight = robustWeight(e / scale);
    if (matches.target[i] < 0 || weight == 0)
      continue;
    const Eigen::Vector3d p(matches.px[i], matches.py[i], matches.pz[i]);
    const Eigen::Vector3d n(matches.nx[i], matches.ny[i], matches.nz[i]);
    const int column = source.index[i] % width / side, row = source.index[i] / width / side;
    Vector6d& gradient = tiles.try_emplace(row * width + column, Vector6d::Zero()).first->second;
    gradient.head<3>() += weight * e * inverse * p.cross(n);
    gradient.tail<3>() += weight * e * inverse * n;
  }
  std::vector<Vector6d> gradients;
  for (const auto& [tile, gradient] : tiles)
    gradients.push_back(gradient);
  return gradients;
}

} // namespace

Pose
motionAbout(const Eigen::Vector3d& center, const Vector6d& delta)
{
  const Eigen::Translation3d to_center(center);
  return to_center * increment(delta) * to_center.inverse();
}

AlignmentTerms::AlignmentTerms(const AlignmentProblem& problem)
: problem_(withUnitNormals(problem)), nearest_(problem_)
{
  if (problem_.source_indices)
    return;
  all_indices_.resize(problem_.source.size);
  std::iota(all_indices_.begin(), all_indices_.end(), 0);
  problem_.source_indices = &all_indices_;
}

bool
AlignmentTerms::prepare(const Pose& pose)
{
  if (problem_.camera && problem_.source.height > 1) {
    std::string reason;
    grid_ = makeTargetGrid(problem_, problem_.target, problem_.world_from_virtual, reason);
    if (!grid_)
      PCL_WARN("[bundle_icp::BundleICP::align] Associating by kd-tree: %s\n", reason.c_str());
  }
  levels_ = selectLevels(problem_, projective());
  const SourcePoints& all = levels_.back();
  if (all.size() == 0)
    return false;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double squared = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Vector3d p(all.x[i], all.y[i], all.z[i]);
    mean += p;
    squared += p.squaredNorm();
  }
  mean /= double(all.size());
  center_ = pose * mean;
  length_ = std::max(1e-9, std::sqrt(squared / double(all.size()) - mean.squaredNorm()));
  return true;
}

bool
AlignmentTerms::renderAgain(const Pose& pose)
{
  if (!problem_.render || !grid_ || renderings_ >= MAX_RENDERINGS)
    return false;
  const Pose moved = grid_->world_from_virtual.inverse() * pose;
  if (moved.translation().norm() <= RENDER_DISTANCE && rotationAngle(moved) <= RENDER_ANGLE)
    return false;
  std::string reason = "nothing was rendered";
  const std::optional<PointsView> target = problem_.render(pose);
  std::optional<TargetGrid> grid;
  if (target)
    grid = makeTargetGrid(problem_, *target, pose, reason);
  if (!grid) {
    PCL_WARN("[bundle_icp::BundleICP::align] The old virtual depth is kept: %s\n", reason.c_str());
    return false;
  }
  grid_ = std::move(grid);
  ++renderings_;
  return true;
}

void
AlignmentTerms::useLevel(std::size_t level, float misalignment)
{
  level_ = level;
  const float limit = float(std::min(problem_.max_distance, 1e18));
  const float generous = misalignment > 0 ? COARSE_DISTANCE : LAST_DISTANCE;
  tolerance_ = {grid_ ? std::min(generous, limit) : limit, misalignment};
}

/** Observed over expected noise that the level takes for granted. */
double
AlignmentTerms::smallestScale() const
{
  if (grid_)
    return tolerance_.misalignment > 0 ? 1 : MIN_SCALE;
  return std::max(1e-6 * length_, LEVEL_RMS_SHARE[level_] * rmsError(matches_));
}

AlignmentTerms::Evaluation
AlignmentTerms::evaluate(const Pose& pose)
{
  if (grid_)
    matchByProjection(problem_, *grid_, source(), pose, center_, tolerance_, matches_);
  else
    nearest_.match(source(), pose, center_, tolerance_.max_distance, matches_);
  Evaluation at;
  at.scale = std::max(smallestScale(), robustScale(matches_));
  at.dense = accumulate(matches_, at.scale, problem_.num_threads);
  if (!problem_.visual.source.empty())
    at.visual = visualTerms(pose);
  Observability observability;
  observability.length = length_;
  observability.misaligned = level_ + 1 < levels_.size();
  if (grid_)
    observability.max_deviation = MAX_DEVIATION;
  // Better residuals than the model expects are no reason to trust them more.
  const double noise = grid_ ? std::max(1.0, at.scale) : at.scale;
  at.variance = source().patch * noise * noise;
  at.step = solve(at.dense, at.variance, at.visual, observability);
  return at;
}

Meeting
AlignmentTerms::meeting(const Pose& pose, double scale) const
{
  return grid_ ? meetingByProjection(*grid_, source(), pose, matches_, scale)
               : nearest_.meeting(source(), matches_, center_);
}

Matrix6d
AlignmentTerms::information(const Evaluation& last) const
{
  if (!grid_)
    return last.step.information;
  return robustInformation(last.step.information, last.variance,
                           tileGradients(source(), problem_.source.width, matches_, last.scale),
                           problem_.model_share);
}

} // namespace bundle_icp
