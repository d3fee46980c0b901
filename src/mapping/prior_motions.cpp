// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/prior_motions.h"

#include "common/by_time.h"
#include "refinement/spread.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bundle_icp {
namespace {

/** Median of chi^2 with three degrees of freedom: what a squared error is in units of its variance
 *  along each axis. */
constexpr double CHI_SQUARED_MEDIAN = 2.366;
/** What chi^2 exceeds as rarely as one number exceeds 3 deviations. */
constexpr double CHI_SQUARED_LIMIT = 14.16;

/** Squared lengths of a translation and of a rotation, in units of their variance along each
 *  axis. */
struct Squares {
  double position = 0, rotation = 0;
};

Squares
squaresOf(const Eigen::Vector3d& translation, double angle, const PriorMotion& unit)
{
  const double position = unit.position_sigma, rotation = unit.rotation_sigma;
  return {translation.squaredNorm() / (position * position), angle * angle / (rotation * rotation)};
}

Squares
errorOf(const PriorMotion& motion, const Pose& first_from_second)
{
  const Pose turn(motion.first_from_second.linear().transpose() * first_from_second.linear());
  return squaresOf(first_from_second.translation() - motion.first_from_second.translation(),
                   rotationAngle(turn), motion);
}

Pose
motionIn(const SparseModel& model, std::size_t first, std::size_t second)
{
  return model.worldFromCamera(first).inverse() * model.worldFromCamera(second);
}

/** The factor on deviations that explains squared errors; infinite when the errors are as large as
 *  the motions themselves, of which they then say nothing. */
double
factorOf(const std::vector<double>& errors, const std::vector<double>& motions)
{
  const double error = medianOf(errors);
  return error < medianOf(motions) ? std::sqrt(std::max(1.0, error / CHI_SQUARED_MEDIAN))
                                   : std::numeric_limits<double>::infinity();
}

/** The standard deviation of a step that squared errors show, one of which was said. */
double
measuredDeviation(double said, const std::vector<double>& errors)
{
  return said * std::sqrt(medianOf(errors) / CHI_SQUARED_MEDIAN);
}

bool
contradicts(const PriorMotion& motion, const Pose& first_from_second)
{
  const Squares error = errorOf(motion, first_from_second);
  return error.position > CHI_SQUARED_LIMIT || error.rotation > CHI_SQUARED_LIMIT;
}

} // namespace

RelativePoseTerm
PriorMotion::term(std::size_t first, std::size_t second) const
{
  RelativePoseTerm term;
  term.first = first;
  term.second = second;
  term.first_from_second = first_from_second;
  term.is_dense = false;
  // A motion (w, v) on the left turns by w and moves the translation t by v + w x t.
  Matrix6d error_by_motion = Matrix6d::Identity();
  error_by_motion.bottomLeftCorner<3, 3>() = -crossMatrix(first_from_second.translation());
  Vector6d weights;
  weights << Eigen::Vector3d::Constant(1 / (rotation_sigma * rotation_sigma)),
      Eigen::Vector3d::Constant(1 / (position_sigma * position_sigma));
  term.information = error_by_motion.transpose() * weights.asDiagonal() * error_by_motion;
  return term;
}

PriorMotions::PriorMotions(const ImageGraph& graph, const MapperOptions& options) : graph_(graph)
{
  const std::vector<std::size_t> by_time = byTime(graph);
  if (options.refinement.pose_prior)
    trust_.report.frames = std::size_t(std::count_if(
        by_time.begin(), by_time.end(), [&graph](auto i) { return graph.prior(i).has_value(); }));
  if (trust_.report.frames == 0 || !options.schedule.ordered_in_time)
    return;
  place_in_time_.resize(by_time.size());
  for (std::size_t place = 0; place < by_time.size(); ++place)
    place_in_time_[by_time[place]] = place;
}

void
PriorMotions::forget()
{
  const std::size_t frames = trust_.report.frames;
  trust_.report = {};
  trust_.report.frames = frames;
  trust_.position_factor = trust_.rotation_factor = 1;
}

std::optional<PriorMotion>
PriorMotions::said(std::size_t first, std::size_t second) const
{
  const std::optional<PosePrior>&a = graph_.prior(first), &b = graph_.prior(second);
  if (place_in_time_.empty() || !a || !b || first == second)
    return std::nullopt;
  const std::size_t from = place_in_time_[first], to = place_in_time_[second];
  const double steps = double(std::max(from, to) - std::min(from, to));
  return PriorMotion{a->world_from_camera.inverse() * b->world_from_camera,
                     std::hypot(a->position_sigma, b->position_sigma) * std::sqrt(steps / 2),
                     std::hypot(a->rotation_sigma, b->rotation_sigma) * std::sqrt(steps / 2)};
}

std::optional<PriorMotion>
PriorMotions::between(std::size_t first, std::size_t second) const
{
  std::optional<PriorMotion> motion = said(first, second);
  const bool is_trusted = trust_.report.uses_position || trust_.report.uses_rotation;
  if (!motion || !is_trusted)
    return std::nullopt;
  motion->position_sigma *= trust_.position_factor;
  motion->rotation_sigma *= trust_.rotation_factor;
  return motion;
}

/** Those that follow each other in time. */
std::vector<PriorMotions::Pair>
PriorMotions::pairsOf(const std::vector<std::size_t>& frames) const
{
  std::vector<Pair> pairs;
  const std::vector<std::size_t> by_time = byTime(graph_, frames);
  for (std::size_t k = 1; k < by_time.size(); ++k)
    pairs.emplace_back(by_time[k - 1], by_time[k]);
  return pairs;
}

void
PriorMotions::measure(const SparseModel& model, const std::vector<std::size_t>& frames)
{
  std::vector<double> position_errors, rotation_errors, translations, rotations;
  std::vector<double> position_sigmas, rotation_sigmas;
  for (const auto& [first, second] : pairsOf(frames))
    if (const auto motion = said(first, second)) {
      const Pose data = motionIn(model, first, second);
      const Squares error = errorOf(*motion, data);
      const Squares moved = squaresOf(data.translation(), rotationAngle(data), *motion);
      position_errors.push_back(error.position);
      rotation_errors.push_back(error.rotation);
      translations.push_back(moved.position);
      rotations.push_back(moved.rotation);
      position_sigmas.push_back(graph_.prior(second)->position_sigma);
      rotation_sigmas.push_back(graph_.prior(second)->rotation_sigma);
    }
  if (position_errors.empty())
    return;
  trust_.position_factor =
      std::max(trust_.position_factor, factorOf(position_errors, translations));
  trust_.rotation_factor = std::max(trust_.rotation_factor, factorOf(rotation_errors, rotations));
  PosePriorReport& report = trust_.report;
  report.motions = position_errors.size();
  report.uses_position = std::isfinite(trust_.position_factor);
  report.uses_rotation = std::isfinite(trust_.rotation_factor);
  report.said_position = medianOf(position_sigmas);
  report.said_rotation = medianOf(rotation_sigmas);
  report.measured_position = measuredDeviation(report.said_position, position_errors);
  report.measured_rotation = measuredDeviation(report.said_rotation, rotation_errors);
  report.left_out = 0;
  for (const auto& [first, second] : pairsOf(frames))
    if (const auto motion = between(first, second))
      report.left_out += contradicts(*motion, motionIn(model, first, second));
}

std::vector<RelativePoseTerm>
PriorMotions::terms(const SparseModel& model, const std::vector<std::size_t>& frames) const
{
  std::vector<RelativePoseTerm> terms;
  for (const auto& [first, second] : pairsOf(frames)) {
    const auto motion = between(first, second);
    if (motion && !contradicts(*motion, motionIn(model, first, second)))
      terms.push_back(motion->term(first, second));
  }
  return terms;
}

} // namespace bundle_icp
