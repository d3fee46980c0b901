// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/registration/point_alignment.h>

#include "registration/nearest_matches.h"
#include "registration/normal_equations.h"
#include "registration/target_grid.h"

#include <pcl/console/print.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace bundle_icp {
namespace {

/** Maximum number of source points of the last level: more do not add independent measurements. */
constexpr double POINTS_OF_LAST_LEVEL = 80000;
/** Minimum number of source points of a level, unless the source has fewer. */
constexpr double MIN_POINTS_OF_LEVEL = 500;
/** Largest distance of a projective match on the coarse levels and the last one [m]. */
constexpr float COARSE_DISTANCE = 0.4f, LAST_DISTANCE = 0.15f;
/** Misalignment that the coarse levels allow for, tried in this order [m]: wide kernels
 * see far structures pull, narrow ones are not led astray by clutter. */
constexpr float MISALIGNMENTS[] = {0.1f, 0.03f, 0.3f};
/** Largest misalignment that a pose from visual evidence leaves [m]. */
constexpr double VISUAL_MISALIGNMENT = 0.03;
/** No further kernel is tried once this share of the source lies on the target. */
constexpr double ENOUGH_OVERLAP = 0.75;
/** With nearest neighbours, whose unit of length is unknown, the same is a share of the
 * root mean square distance. */
constexpr double LEVEL_RMS_SHARE[] = {1, 0.3, 0};
/** Share of the iterations that one run of a coarse level may spend, and all of them together. */
constexpr double COARSE_BUDGET = 0.15, ALL_COARSE_BUDGET = 0.75;
/** Observed noise counts as at least this share of the model's: residuals of exact data
 * must not declare every curvature an outlier. */
constexpr double MIN_SCALE = 0.25;
/** Nor does more of it than this make points lie on the target that are far from it. */
constexpr double LARGEST_SCALE = 2;
/** Clouds meet when at least this share of the source lies on the target, and clearly more speaks
 * for the pose than against it. On pairs of three recordings, right poses have an agreement of 0.75
 * and more but for steps of half a metre (0.55), wrong ones that ICP was led to 0.5 and less. */
constexpr double MIN_OVERLAP = 0.1, MIN_AGREEMENT = 0.6;
/** The virtual depth is rendered anew when the pose has moved further than this. */
constexpr double RENDER_DISTANCE = 0.02, RENDER_ANGLE = 2 * M_PI / 180;
constexpr int MAX_RENDERINGS = 4;
/** Pixels of one independent measurement, at a focal length of 525 px. */
constexpr double CORRELATED_PIXELS = 81, CORRELATED_FOCAL = 525;
/** A direction of projective association that is known no better than this is not held
 * [m]. */
constexpr double MAX_DEVIATION = 0.02;

/** A small motion about a centre instead of the origin. */
Pose
about(const Eigen::Vector3d& center, const Vector6d& delta)
{
  const Eigen::Translation3d to_center(center);
  return to_center * increment(delta) * to_center.inverse();
}

class Aligner {
public:
  Aligner(const AlignmentProblem& problem, const Pose& start);

  bool
  prepare();
  Alignment
  invalid();
  void
  approach();
  bool
  refine();
  Alignment
  finish(bool done);

private:
  struct Evaluation {
    DenseSystem dense;
    VisualSystem visual;
    double scale = 1;
    double variance = 1; ///< by which dense terms overstate their information
    Step step;
  };

  bool
  renderAgain();
  void
  selectLevels();
  void
  useLevel(std::size_t level, float misalignment);
  double
  overlapOnLevel(std::size_t level);
  bool
  runLevel(std::size_t level, float misalignment);
  double
  smallestScale() const;
  Evaluation
  evaluate();
  bool
  converged(const Pose& motion, std::size_t level) const;
  void
  iterate(const Evaluation& at);
  void
  notify() const;
  std::vector<Vector6d>
  tileGradients(double scale) const;
  void
  report(const Evaluation& at);
  bool
  breaksVisualEvidence() const;
  bool
  hasVisualEvidence() const
  {
    return !problem_.visual.source.empty();
  }

  AlignmentProblem problem_;
  std::vector<int> all_indices_; ///< when the problem names none
  NearestMatcher nearest_;
  std::optional<TargetGrid> grid_;
  std::vector<SourcePoints> levels_;
  std::size_t level_ = 0;
  const SourcePoints* source_ = nullptr;
  MatchTolerance tolerance_;
  Matches matches_;
  Pose pose_, initial_pose_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double length_ = 1, mean_squared_ = -1;
  Alignment out_;
};

/** Normals that are not of unit length count as missing. */
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

Aligner::Aligner(const AlignmentProblem& problem, const Pose& start)
: problem_(withUnitNormals(problem)), nearest_(problem_), pose_(start), initial_pose_(start)
{
  if (problem_.source_indices)
    return;
  all_indices_.resize(problem_.source.size);
  std::iota(all_indices_.begin(), all_indices_.end(), 0);
  problem_.source_indices = &all_indices_;
}

bool
Aligner::renderAgain()
{
  if (!problem_.render || !grid_ || out_.result.renderings >= MAX_RENDERINGS)
    return false;
  const Pose moved = grid_->world_from_virtual.inverse() * pose_;
  if (moved.translation().norm() <= RENDER_DISTANCE && rotationAngle(moved) <= RENDER_ANGLE)
    return false;
  std::string reason = "nothing was rendered";
  const std::optional<PointsView> target = problem_.render(pose_);
  std::optional<TargetGrid> grid;
  if (target)
    grid = makeTargetGrid(problem_, *target, pose_, reason);
  if (!grid) {
    PCL_WARN("[bundle_icp::BundleICP::align] The old virtual depth is kept: %s\n", reason.c_str());
    return false;
  }
  grid_ = std::move(grid);
  ++out_.result.renderings;
  return true;
}

/** From every fourth pixel of the last level's grid to that itself. */
void
Aligner::selectLevels()
{
  const double points = static_cast<double>(problem_.source_indices->size());
  const int last =
      std::max(1, static_cast<int>(std::lround(std::sqrt(points / POINTS_OF_LAST_LEVEL))));
  const double focal = problem_.camera ? problem_.camera->fx : CORRELATED_FOCAL;
  const int sparsest = std::max(1, static_cast<int>(std::sqrt(points / MIN_POINTS_OF_LEVEL)));
  for (const int wanted : {4 * last, 2 * last, last}) {
    const int stride = std::min(wanted, sparsest);
    SourcePoints level = selectSource(problem_, stride);
    level.stride = stride;
    level.patch = std::max(1.0, CORRELATED_PIXELS * std::pow(focal / CORRELATED_FOCAL, 2) /
                                    (stride * stride));
    if (!grid_)
      level.patch = 1;
    levels_.push_back(std::move(level));
  }
}

bool
Aligner::prepare()
{
  if (problem_.camera && problem_.source.height > 1) {
    std::string reason;
    grid_ = makeTargetGrid(problem_, problem_.target, problem_.world_from_virtual, reason);
    if (!grid_)
      PCL_WARN("[bundle_icp::BundleICP::align] Associating by kd-tree: %s\n", reason.c_str());
  }
  out_.result.projective = grid_.has_value();
  out_.result.visual_initial_pose = hasVisualEvidence();
  selectLevels();
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
  mean /= static_cast<double>(all.size());
  center_ = pose_ * mean;
  length_ =
      std::max(1e-9, std::sqrt(squared / static_cast<double>(all.size()) - mean.squaredNorm()));
  return true;
}

/** When there is nothing to align. */
Alignment
Aligner::invalid()
{
  PCL_ERROR("[bundle_icp::BundleICP::align] The source has no finite point\n");
  out_.result.status = BundleICPStatus::INVALID_INPUT;
  out_.world_from_source = pose_;
  return out_;
}

/** Observed over expected noise that the level takes for granted. */
double
Aligner::smallestScale() const
{
  if (grid_)
    return tolerance_.misalignment > 0 ? 1 : MIN_SCALE;
  return std::max(1e-6 * length_, LEVEL_RMS_SHARE[level_] * rmsError(matches_));
}

Aligner::Evaluation
Aligner::evaluate()
{
  if (grid_)
    matchByProjection(problem_, *grid_, *source_, pose_, center_, tolerance_, matches_);
  else
    nearest_.match(*source_, pose_, center_, tolerance_.max_distance, matches_);
  Evaluation at;
  at.scale = std::max(smallestScale(), robustScale(matches_));
  at.dense = accumulate(matches_, at.scale, problem_.num_threads);
  if (hasVisualEvidence())
    at.visual = accumulateVisual(problem_.visual, pose_, center_, problem_.visual_scale);
  Observability observability;
  observability.length = length_;
  observability.misaligned = level_ + 1 < levels_.size();
  if (grid_)
    observability.max_deviation = MAX_DEVIATION;
  // Better residuals than the model expects are no reason to trust them more.
  const double noise = grid_ ? std::max(1.0, at.scale) : at.scale;
  at.variance = source_->patch * noise * noise;
  at.step = solve(at.dense, at.variance, at.visual, observability);
  return at;
}

bool
Aligner::converged(const Pose& motion, std::size_t level) const
{
  // A coarse level only prepares the next.
  const double loose = level + 1 < levels_.size() ? 100 : 1;
  const double cosine = std::cos(rotationAngle(motion));
  const Eigen::Vector3d moved = motion * center_ - center_;
  return moved.squaredNorm() <= loose * problem_.translation_epsilon &&
         1 - cosine <= loose * (1 - problem_.rotation_epsilon);
}

void
Aligner::iterate(const Evaluation& at)
{
  out_.last_step = about(center_, at.step.delta);
  pose_ = closestPose((out_.last_step * pose_).matrix());
  ++out_.result.iterations;
  if (problem_.on_iteration)
    notify();
}

void
Aligner::notify() const
{
  std::vector<int> source, target;
  for (std::size_t i = 0; i < source_->size(); ++i)
    if (matches_.target[i] >= 0) {
      source.push_back(source_->index[i]);
      target.push_back(matches_.target[i]);
    }
  problem_.on_iteration(pose_, source, target);
}

void
Aligner::useLevel(std::size_t level, float misalignment)
{
  level_ = level;
  source_ = &levels_[level];
  const float limit = static_cast<float>(std::min(problem_.max_distance, 1e18));
  const float generous = misalignment > 0 ? COARSE_DISTANCE : LAST_DISTANCE;
  tolerance_ = {grid_ ? std::min(generous, limit) : limit, misalignment};
}

/** Share of the level's points that lie on the target within the expected noise. */
double
Aligner::overlapOnLevel(std::size_t level)
{
  useLevel(level, 0);
  evaluate();
  return static_cast<double>(accumulate(matches_, 1, problem_.num_threads).inliers) /
         static_cast<double>(std::max<std::size_t>(1, source_->size()));
}

/** The coarse levels: brings the pose near enough for the last one. */
void
Aligner::approach()
{
  renderAgain();
  const std::size_t coarse = levels_.size() - 1;
  const Pose start = pose_;
  Pose best = start;
  double best_overlap = -1;
  const double limit = hasVisualEvidence()
                           ? std::min(VISUAL_MISALIGNMENT, problem_.max_misalignment)
                           : problem_.max_misalignment;
  for (const float misalignment : MISALIGNMENTS) {
    if (grid_ && misalignment > float(limit))
      continue;
    pose_ = start;
    for (std::size_t level = 0; level < coarse; ++level)
      runLevel(level, level == 0 ? misalignment : std::min(misalignment, 0.03f));
    if (!grid_)
      return;
    const double overlap = overlapOnLevel(coarse - 1);
    if (overlap > best_overlap) {
      best_overlap = overlap;
      best = pose_;
    }
    if (overlap >= ENOUGH_OVERLAP)
      break;
  }
  pose_ = best;
}

/** Iterates on one level. \return true when it converged within the budget. */
bool
Aligner::runLevel(std::size_t level, float misalignment)
{
  const bool last = level + 1 == levels_.size();
  useLevel(level, misalignment);
  const int budget = last ? problem_.max_iterations
                          : std::min(static_cast<int>(ALL_COARSE_BUDGET * problem_.max_iterations),
                                     out_.result.iterations +
                                         static_cast<int>(COARSE_BUDGET * problem_.max_iterations));
  mean_squared_ = -1;
  while (out_.result.iterations < budget) {
    const Evaluation at = evaluate();
    if (at.dense.matched < 6)
      return false;
    iterate(at);
    const double mean = at.dense.squared_error / std::max(1e-300, at.dense.weight_metric);
    const bool settled = mean_squared_ >= 0 && problem_.fitness_epsilon > 0 &&
                         std::abs(mean - mean_squared_) < problem_.fitness_epsilon * mean_squared_;
    mean_squared_ = mean;
    if (settled || converged(out_.last_step, level))
      return true;
  }
  return false;
}

/** True when the visual correspondences agree clearly less with the refined pose than
 * with their own: more than noise and a systematic error of either sensor explain. */
bool
Aligner::breaksVisualEvidence() const
{
  if (!hasVisualEvidence())
    return false;
  const VisualSystem before =
      accumulateVisual(problem_.visual, initial_pose_, center_, problem_.visual_scale);
  const VisualSystem after =
      accumulateVisual(problem_.visual, pose_, center_, problem_.visual_scale);
  return after.cost > 1.3 * before.cost + 20 ||
         static_cast<double>(after.inliers) < 0.7 * static_cast<double>(before.inliers);
}

/** Gradients of the dense terms, summed over tiles of the image: neighbouring pixels share errors,
 * of the camera and of the surface that they are compared with. */
std::vector<Vector6d>
Aligner::tileGradients(double scale) const
{
  constexpr int SIDE = 16; // samples; errors reach less far
  const int width = problem_.source.width, side = SIDE * source_->stride;
  std::map<int, Vector6d> tiles;
  for (std::size_t i = 0; i < source_->size(); ++i) {
    const double inverse = matches_.inverse_sigma[i], e = matches_.residual[i] * inverse;
    const double weight = robustWeight(e / scale);
    if (matches_.target[i] < 0 || weight == 0)
      continue;
    const Eigen::Vector3d p(matches_.px[i], matches_.py[i], matches_.pz[i]);
    const Eigen::Vector3d n(matches_.nx[i], matches_.ny[i], matches_.nz[i]);
    const int column = source_->index[i] % width / side, row = source_->index[i] / width / side;
    Vector6d& gradient = tiles.try_emplace(row * width + column, Vector6d::Zero()).first->second;
    gradient.head<3>() += weight * e * inverse * p.cross(n);
    gradient.tail<3>() += weight * e * inverse * n;
  }
  std::vector<Vector6d> gradients;
  for (const auto& [tile, gradient] : tiles)
    gradients.push_back(gradient);
  return gradients;
}

void
Aligner::report(const Evaluation& at)
{
  BundleICPResult& result = out_.result;
  const Meeting meeting = grid_ ? meetingByProjection(*grid_, *source_, pose_, matches_,
                                                      std::min(at.scale, LARGEST_SCALE))
                                : nearest_.meeting(*source_, matches_, center_);
  result.inliers = static_cast<std::size_t>(meeting.near);
  result.overlap = meeting.near / static_cast<double>(source_->size());
  result.agreement = meeting.near / std::max(1.0, meeting.near + meeting.against);
  if (hasConverged(result.status) &&
      (result.overlap < MIN_OVERLAP || result.agreement < MIN_AGREEMENT))
    result.status = BundleICPStatus::NO_OVERLAP;
  result.rmse = std::sqrt(at.dense.squared_inliers /
                          std::max<double>(1, static_cast<double>(result.inliers)));
  const VisualSystem visual =
      accumulateVisual(problem_.visual, pose_, center_, problem_.visual_scale);
  result.visual_inliers = visual.inliers;
  result.visual_rmse =
      std::sqrt(visual.squared_inliers / std::max<double>(1, static_cast<double>(visual.inliers)));
  // From motions about the centre to motions about the origin of the world.
  Matrix6d to_center = Matrix6d::Identity(), to_origin = to_center;
  to_center.bottomLeftCorner<3, 3>() = -crossMatrix(center_);
  to_origin.bottomLeftCorner<3, 3>() = crossMatrix(center_);
  const Matrix6d information =
      grid_ ? robustInformation(at.step.information, at.variance, tileGradients(at.scale),
                                problem_.model_share)
            : at.step.information;
  result.information = to_center.transpose() * information * to_center;
  for (const Vector6d& direction : at.step.degenerate)
    result.degenerate_directions.push_back((to_origin * direction).normalized());
  out_.world_from_source = pose_;
  result.dense_pose = about(center_, at.step.dense_delta) * pose_;
}

/** The last levels, with the virtual depth rendered anew as the pose moves.
 *  \return true when the last one converged within the iterations. */
bool
Aligner::refine()
{
  const std::size_t last = levels_.size() - 1;
  renderAgain();
  // Most of the way at a quarter of the cost; the last level then has little left to do.
  if (grid_)
    runLevel(last - 1, 0);
  bool done = runLevel(last, 0);
  while (done && renderAgain())
    done = runLevel(last, 0);
  return done;
}

/** The verdict, and the pose that it leaves. */
Alignment
Aligner::finish(bool done)
{
  BundleICPStatus& status = out_.result.status;
  Evaluation at = evaluate();
  status = done ? BundleICPStatus::CONVERGED : BundleICPStatus::MAX_ITERATIONS;
  if (at.dense.matched < 6)
    status = BundleICPStatus::TOO_FEW_CORRESPONDENCES;
  else if (breaksVisualEvidence())
    status = BundleICPStatus::REFINEMENT_REJECTED;
  if (!hasConverged(status)) {
    pose_ = initial_pose_;
    at = evaluate();
  }
  report(at);
  return out_;
}

} // namespace

Alignment
alignPoints(const AlignmentProblem& problem, const Pose& start)
{
  Aligner aligner(problem, start);
  if (!aligner.prepare())
    return aligner.invalid();
  aligner.approach();
  const bool done = aligner.refine();
  return aligner.finish(done);
}

} // namespace bundle_icp
