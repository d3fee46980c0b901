// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/frame_registrar.h"

#include "registration/pnp_pose.h"
#include "registration/shared_error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <iomanip>
#include <set>
#include <sstream>

namespace bundle_icp {
namespace {

std::vector<cv::Point2d>
pixelsOf(const Features& features, const std::vector<int>& indices)
{
  std::vector<cv::Point2d> pixels;
  for (const int j : indices)
    pixels.emplace_back(features.pixels[j].x(), features.pixels[j].y());
  return pixels;
}

/** Smallest shared error of an image's pixels [sigma]: errors of neighbouring pixels are
 *  correlated, so only some thousand pixels are independent. */
constexpr double LEAST_SHARED_SIGMAS = 0.03;

/** Depth is not aligned when no variance of the pose could fall by more than this share. */
constexpr double LEAST_DENSE_GAIN = 0.05;

double
meanDepth(const Features& features)
{
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t j = 0; j < features.size(); ++j)
    if (features.hasDepth(int(j))) {
      sum += features.depths[j];
      ++count;
    }
  return count ? sum / double(count) : 0;
}

/** Information of a dense term on motions of either frame that are applied on the left of its pose
 *  in the world, while the other stays: the adjoint of first_from_world takes them to the first
 *  camera's frame, where the term holds its own. */
Matrix6d
informationInWorld(const RelativePoseTerm& term, const Pose& world_from_first)
{
  const Pose first_from_world = world_from_first.inverse();
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = first_from_world.linear();
  adjoint.bottomRightCorner<3, 3>() = first_from_world.linear();
  adjoint.bottomLeftCorner<3, 3>() =
      crossMatrix(first_from_world.translation()) * first_from_world.linear();
  return adjoint.transpose() * term.information * adjoint;
}

/** With the sources in another frame. */
VisualCorrespondences
transformed(VisualCorrespondences matches, const Pose& new_from_old)
{
  for (Eigen::Vector3d& point : matches.source)
    point = new_from_old * point;
  return matches;
}

} // namespace

void
FrameRegistrar::setDepthErrors(bool depth_errors)
{
  depth_errors_ = depth_errors;
  shared_depth_sigmas_ = depth_errors ? options_.shared_depth_sigmas
                                      : std::min(LEAST_SHARED_SIGMAS, options_.shared_depth_sigmas);
}

std::vector<Neighbour>
FrameRegistrar::registeredNeighbours(const SparseModel& model, std::size_t frame,
                                     int component) const
{
  std::vector<Neighbour> neighbours;
  for (const ImageEdge& edge : graph_.edges(frame))
    if (model.component(edge.neighbour) == component)
      neighbours.push_back({edge.neighbour, edge.pair->matches.size()});
  std::stable_sort(neighbours.begin(), neighbours.end(),
                   [](const Neighbour& a, const Neighbour& b) { return a.matches > b.matches; });
  return neighbours;
}

NewFrame
FrameRegistrar::newFrame(const SparseModel& model, std::size_t frame, int component,
                         int num_threads) const
{
  NewFrame new_frame{frame, registeredNeighbours(model, frame, component), {}, num_threads};
  if (!options_.visual_start)
    new_frame.guess = model.worldFromCamera(new_frame.neighbours.front().frame);
  return new_frame;
}

FrameRegistration
FrameRegistrar::bundleICP(const SparseModel& model, const NewFrame& new_frame) const
{
  // 1: M_reg,new = Find Correspondence Point(I_reg, I_new)
  const Correspondences matches = findCorrespondences(model, new_frame);
  // 2: T*_new = argmin sum |T_i^w X_i,m - T_new^w X_new,n|^2
  FrameRegistration registration;
  const std::optional<RigidAlignment> initial = initialPose(new_frame, matches, registration);
  if (!initial && !new_frame.guess)
    return registration;
  const Pose start = initial ? initial->target_from_source : *new_frame.guess;
  const FrameRegistration visual = adjusted(model, new_frame.index, matches, {start}, registration);
  if (initial && !canDepthImprove(new_frame.index, visual))
    return visual;
  // 3: I_vir^d = Virtual Depth(T*_new, I_reg^d), from where the camera was when depth was taken
  const Pose depth_from_color = model.depthFromColor(new_frame.index);
  const Pose depth_start = start * depth_from_color.inverse();
  DepthAlignment alignment(depth_views_(new_frame.index, model),
                           virtualDepthOptions(new_frame.num_threads));
  showVirtualDepth(model, new_frame, depth_start, alignment);
  if (initial)
    alignment.setVisualEvidence(transformed(matches.points, depth_from_color), initial->scale);
  // 4 to 7: until T*_new stays, A_a = Compute_Closest_Points(T*_new, I_vir^d, I_new^d) and
  // T*_new = Optimized_Alignment(T*_new, I_vir^d, I_new^d)
  const BundleICPResult dense = alignPoints(alignment.problem(), depth_start);
  // The verdict: what both say together, if depth says anything
  registration.icp_rmse = dense.rmse;
  registration.overlap = dense.overlap;
  if (!isEvidence(dense, registration))
    return initial ? visual : registration;
  return adjusted(model, new_frame.index, matches, denseEvidence(model, new_frame.index, dense),
                  registration);
}

BundleICPResult
FrameRegistrar::alignDepth(const SparseModel& model, const NewFrame& new_frame) const
{
  const Pose start = *new_frame.guess * model.depthFromColor(new_frame.index).inverse();
  DepthAlignment alignment(depth_views_(new_frame.index, model),
                           virtualDepthOptions(new_frame.num_threads));
  showVirtualDepth(model, new_frame, start, alignment);
  alignment.trustStart();
  return alignPoints(alignment.problem(), start);
}

FrameRegistration
FrameRegistrar::registerVisually(const SparseModel& model, const NewFrame& new_frame) const
{
  const Correspondences matches = findCorrespondences(model, new_frame);
  FrameRegistration registration;
  const std::optional<RigidAlignment> initial = initialPose(new_frame, matches, registration);
  if (!initial)
    return registration;
  return adjusted(model, new_frame.index, matches, {initial->target_from_source}, registration);
}

FrameRegistrar::Correspondences
FrameRegistrar::findCorrespondences(const SparseModel& model, const NewFrame& new_frame) const
{
  Correspondences found;
  if (new_frame.guess)
    return found;
  const std::size_t frame = new_frame.index;
  const Features& features = graph_.features(frame);
  std::set<std::size_t> wanted;
  for (const Neighbour& neighbour : new_frame.neighbours)
    wanted.insert(neighbour.frame);
  std::set<std::pair<int, int>> seen; // feature and point: several frames show the same one
  for (const ImageEdge& edge : graph_.edges(frame)) {
    if (!wanted.count(edge.neighbour))
      continue;
    const bool is_first = edge.pair->first == frame;
    const Features& others = graph_.features(edge.neighbour);
    for (const FeatureMatch& match : edge.pair->matches) {
      const int own = is_first ? match.first : match.second;
      const int other = is_first ? match.second : match.first;
      const int point = model.pointOf(edge.neighbour, other);
      if (point >= 0 && !seen.insert({own, point}).second)
        continue;
      const double variance = pointVariance(features, own, graph_.camera());
      double other_variance = pointVariance(others, other, graph_.camera());
      if (point >= 0) // the mean of a track is better than one measurement
        other_variance /= double(model.points()[point].track.size());
      found.features.push_back(own);
      found.points.source.push_back(measuredPointInCamera(graph_, model, {frame, own}));
      found.points.target.push_back(point >= 0
                                        ? model.points()[point].position
                                        : measuredPoint(graph_, model, {edge.neighbour, other}));
      found.points.weights.push_back(1 / (variance + other_variance));
    }
  }
  return found;
}

/** By FrameRegistrationOptions::method; unset with the reason in the registration. */
std::optional<RigidAlignment>
FrameRegistrar::initialPose(const NewFrame& new_frame, const Correspondences& matches,
                            FrameRegistration& registration) const
{
  registration.by_geometry = new_frame.guess.has_value();
  registration.matches = matches.features.size();
  if (new_frame.guess)
    return std::nullopt;
  const std::optional<RigidAlignment> initial =
      options_.method == FrameRegistrationMethod::PNP
          ? estimatePnPPose(graph_.camera(),
                            pixelsOf(graph_.features(new_frame.index), matches.features),
                            matches.points.target)
          : estimateVisualPose(matches.points);
  registration.inliers = initial ? initial->inliers.size() : 0;
  if (registration.inliers >= options_.min_visual_inliers)
    return initial;
  registration.reason = "only " + std::to_string(registration.inliers) + " of " +
                        std::to_string(registration.matches) +
                        " visual correspondences agree on a pose; needed are " +
                        std::to_string(options_.min_visual_inliers);
  return std::nullopt;
}

/** Dense evidence is at best as good as the error that a frame's pixels share. */
bool
FrameRegistrar::canDepthImprove(std::size_t frame, const FrameRegistration& visual) const
{
  if (options_.method != FrameRegistrationMethod::BUNDLE_ICP)
    return false;
  const double z = meanDepth(graph_.features(frame));
  if (graph_.isKey(frame) || !visual.registered || !(z > 0))
    return true;
  const SharedError shared(z, graph_.camera().depth_noise, shared_depth_sigmas_);
  const double rotation = visual.rotation_deviation / shared.tilt;
  const double position = visual.position_deviation / shared.shift;
  return rotation * rotation + position * position > LEAST_DENSE_GAIN;
}

/** Of the best covisible frames. */
void
FrameRegistrar::showVirtualDepth(const SparseModel& model, const NewFrame& new_frame,
                                 const Pose& start, DepthAlignment& alignment) const
{
  std::vector<DepthAlignment::View> views;
  std::vector<Pose> poses;
  for (const Neighbour& neighbour : new_frame.neighbours) {
    if (views.size() == options_.max_views)
      break;
    views.push_back(depth_views_(neighbour.frame, model));
    poses.push_back(model.worldFromDepth(neighbour.frame));
  }
  alignment.setVirtualDepth(views, poses, start);
}

VirtualDepthOptions
FrameRegistrar::virtualDepthOptions(int num_threads) const
{
  VirtualDepthOptions options = options_.virtual_depth;
  options.num_threads = num_threads;
  return options;
}

/** Whether ICP measured the pose: it ended where the surfaces meet and, on its own, leaves nothing
 *  open; otherwise with the reason in the registration. */
bool
FrameRegistrar::isEvidence(const BundleICPResult& dense, FrameRegistration& registration) const
{
  if (!registration.by_geometry)
    return hasConverged(dense.status);
  if (dense.status != BundleICPStatus::CONVERGED && dense.status != BundleICPStatus::LOW_OVERLAP)
    registration.reason = "geometry alone did not converge";
  else if (dense.overlap < options_.min_overlap)
    registration.reason = "geometry alone: only " + std::to_string(int(100 * dense.overlap)) +
                          " % of the depth lies on the model";
  else if (!dense.degenerate_directions.empty())
    registration.reason = "geometry alone leaves " +
                          std::to_string(dense.degenerate_directions.size()) +
                          " directions of motion open";
  else if (dense.status == BundleICPStatus::LOW_OVERLAP)
    registration.reason = "geometry alone fits too little, or another pose as well";
  return registration.reason.empty();
}

DensePoseTerm
FrameRegistrar::denseEvidence(const SparseModel& model, std::size_t frame,
                              const BundleICPResult& dense) const
{
  return {dense.dense_pose * model.depthFromColor(frame),
          withSharedError(dense.information, *depth_views_(frame, model),
                          graph_.camera().depth_noise, shared_depth_sigmas_, 1)};
}

FrameRegistration
FrameRegistrar::adjusted(const SparseModel& model, std::size_t frame,
                         const Correspondences& matches, const DensePoseTerm& dense,
                         FrameRegistration registration) const
{
  std::vector<PointObservation> observations;
  for (std::size_t k = 0; k < matches.features.size(); ++k)
    observations.push_back({matches.features[k], matches.points.target[k]});
  PoseEstimate& pose = registration;
  pose = adjustPose(graph_, model, frame, observations, dense, adjustment_, depth_errors_,
                    {dense.world_from_camera, model.depthError(frame)});
  registration.rotation_deviation = largestDeviation(pose.covariance.topLeftCorner<3, 3>());
  registration.position_deviation = largestDeviation(pose.covariance.bottomRightCorner<3, 3>());
  registration.registered = registration.position_deviation <= options_.max_position_deviation &&
                            registration.rotation_deviation <= options_.max_rotation_deviation;
  if (!registration.registered) {
    std::ostringstream reason;
    reason << "its matches and its depth leave the pose open: +- " << std::setprecision(2)
           << 100 * registration.position_deviation << " cm along, or +- "
           << registration.rotation_deviation * 180 / M_PI << " degrees about, some direction";
    registration.reason = reason.str();
  }
  return registration;
}

Matrix6d
FrameRegistrar::poseCovariance(const SparseModel& model, std::size_t frame,
                               const std::vector<RelativePoseTerm>& terms) const
{
  DensePoseTerm dense{model.worldFromCamera(frame)};
  for (const RelativePoseTerm& term : terms)
    if (term.first == frame || term.second == frame)
      dense.information += informationInWorld(term, model.worldFromCamera(term.first));
  std::vector<PointObservation> observations;
  for (std::size_t j = 0; j < graph_.features(frame).size(); ++j)
    if (const int point = model.pointOf(frame, int(j)); point >= 0)
      observations.push_back({int(j), model.points()[std::size_t(point)].position});
  return adjustPose(graph_, model, frame, observations, dense, adjustment_, depth_errors_,
                    {model.worldFromCamera(frame), model.depthError(frame)})
      .covariance;
}

std::optional<RelativePoseTerm>
FrameRegistrar::registerPair(const SparseModel& model, std::size_t first, std::size_t second) const
{
  const std::shared_ptr<const DepthView> target = depth_views_(first, model);
  const std::shared_ptr<const DepthView> source = depth_views_(second, model);
  const Pose guess = model.worldFromDepth(first).inverse() * model.worldFromDepth(second);
  DepthAlignment alignment(source, virtualDepthOptions(1));
  alignment.setView(*target);
  const BundleICPResult result = alignPoints(alignment.problem(), guess);
  if (result.status != BundleICPStatus::CONVERGED || result.overlap < 0.2)
    return std::nullopt;
  RelativePoseTerm term;
  term.first = first;
  term.second = second;
  term.first_from_second =
      model.depthFromColor(first).inverse() * result.dense_pose * model.depthFromColor(second);
  term.information = withSharedError(result.information, *source, graph_.camera().depth_noise,
                                     shared_depth_sigmas_, 2);
  return term;
}

} // namespace bundle_icp
