// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/frame_registration.h"

#include "sparse/pnp_pose.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <iomanip>
#include <set>
#include <sstream>

namespace bundle_icp {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;
using DenseBundleICP = BundleICP<pcl::PointXYZRGBNormal, pcl::PointXYZRGBNormal>;

std::vector<cv::Point2d>
pixelsOf(const Features& features, const std::vector<int>& indices)
{
  std::vector<cv::Point2d> pixels;
  for (const int j : indices)
    pixels.emplace_back(features.pixels[j].x(), features.pixels[j].y());
  return pixels;
}

/** What an image's pixels share even of independent errors, since those of neighbouring pixels
 *  are correlated: some thousand of them are independent. */
constexpr double LEAST_SHARED_SIGMAS = 0.03;

/** Depth is not aligned when it cannot lower any variance of the pose by more than this share. */
constexpr double LEAST_DENSE_GAIN = 0.05;

/** Standard deviations of the error that the pixels of an image share, by their mean depth [m]. */
struct SharedError {
  double shift; ///< [m]
  double tilt;  ///< [rad]

  SharedError(double mean_depth, const DepthNoise& noise, double sigmas)
  : shift(sigmas * noise.sigma(mean_depth)), tilt(shift / mean_depth)
  {
  }
};

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

/** Information on a pose from the depth of `num_images` images, given the information H that it held if
 *  errors of pixels were independent, and C, the covariance of the error that an image's pixels share:
 *  (H^-1 + n C)^-1, written so that H may be singular. */
Matrix6d
withSharedError(const Matrix6d& independent,
                const DepthView& view,
                const DepthNoise& noise,
                double shared_sigmas,
                int num_images)
{
  const cv::Mat measured = view.depth == view.depth; // NaN differs from itself
  const double z = std::max(cv::mean(view.depth, measured)[0], 0.1);
  const SharedError shared(z, noise, shared_sigmas);
  Vector6d precision; // of n C
  precision << Eigen::Vector3d::Constant(1 / (shared.tilt * shared.tilt)),
      Eigen::Vector3d::Constant(1 / (shared.shift * shared.shift));
  precision /= num_images;
  Matrix6d sum = independent;
  sum.diagonal() += precision;
  const Matrix6d result = independent - independent * sum.ldlt().solve(independent);
  return 0.5 * (result + result.transpose());
}

/** Covariance of a camera's rotation and position, from the information on motions that are
 *  applied on the left of its pose and so turn it about the world's origin. */
Matrix6d
covarianceOf(const Matrix6d& information, const Eigen::Vector3d& position)
{
  Matrix6d pivoted = Matrix6d::Identity();
  pivoted.bottomLeftCorner<3, 3>() = -crossMatrix(position);
  return pivoted * (information + PRIOR_INFORMATION * Matrix6d::Identity()).inverse() * pivoted.transpose();
}

/** Information of a dense term on motions of either image that are applied on the left of its pose
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

} // namespace

void
FrameRegistrar::setDepthErrors(bool depth_errors)
{
  depth_errors_ = depth_errors;
  shared_depth_sigmas_ = depth_errors
                             ? options_.shared_depth_sigmas
                             : std::min(LEAST_SHARED_SIGMAS, options_.shared_depth_sigmas);
}

std::vector<Neighbour>
FrameRegistrar::registeredNeighbours(const SparseModel& model,
                                     std::size_t image,
                                     int component) const
{
  std::vector<Neighbour> neighbours;
  for (const ImageEdge& edge : graph_.edges(image))
    if (model.component(edge.neighbour) == component)
      neighbours.push_back({edge.neighbour, edge.pair->matches.size()});
  std::stable_sort(neighbours.begin(), neighbours.end(), [](const Neighbour& a, const Neighbour& b) {
    return a.matches > b.matches;
  });
  return neighbours;
}

VisualCorrespondences
FrameRegistrar::findCorrespondences(const SparseModel& model,
                                    std::size_t image,
                                    const std::vector<Neighbour>& neighbours,
                                    std::vector<int>& own_features) const
{
  VisualCorrespondences visual;
  const CameraIntrinsics& camera = graph_.camera();
  const Features& features = graph_.features(image);
  std::set<std::size_t> wanted;
  for (const Neighbour& neighbour : neighbours)
    wanted.insert(neighbour.image);
  std::set<std::pair<int, int>> seen; // feature and point: several images show the same one
  for (const ImageEdge& edge : graph_.edges(image)) {
    if (!wanted.count(edge.neighbour))
      continue;
    const bool is_first = edge.pair->first == image;
    const Features& others = graph_.features(edge.neighbour);
    for (const FeatureMatch& match : edge.pair->matches) {
      const int own = is_first ? match.first : match.second;
      const int other = is_first ? match.second : match.first;
      const int point = model.pointOf(edge.neighbour, other);
      if (point >= 0 && !seen.insert({own, point}).second)
        continue;
      double variance = pointVariance(features, own, camera);
      double other_variance = pointVariance(others, other, camera);
      if (point >= 0) // the mean of a track is better than one measurement
        other_variance /= double(model.points()[point].track.size());
      own_features.push_back(own);
      visual.source.push_back(measuredPointInCamera(graph_, model, {image, own}));
      visual.target.push_back(point >= 0 ? model.points()[point].position
                                         : measuredPoint(graph_, model, {edge.neighbour, other}));
      visual.weights.push_back(1 / (variance + other_variance));
    }
  }
  return visual;
}

Alignment
FrameRegistrar::alignToVirtualDepth(const SparseModel& model,
                                    std::size_t image,
                                    const std::vector<Neighbour>& neighbours,
                                    const VisualCorrespondences& visual,
                                    const Pose& guess,
                                    int num_threads) const
{
  const std::shared_ptr<const DepthView> source = depth_views_(image, model);
  std::vector<std::shared_ptr<const DepthView>> held;
  std::vector<RegisteredView> views;
  for (const Neighbour& neighbour : neighbours) {
    if (views.size() == options_.max_views)
      break;
    held.push_back(depth_views_(neighbour.image, model));
    views.push_back({held.back().get(), model.worldFromDepth(neighbour.image)});
  }
  VirtualDepthOptions rendering = options_.virtual_depth;
  rendering.num_threads = num_threads;
  const auto render = [&](const Pose& world_from_virtual) -> Cloud::Ptr {
    return toPointCloud(renderVirtualDepth(views, source->camera, world_from_virtual, rendering));
  };

  DenseBundleICP icp;
  icp.setNumberOfThreads(num_threads);
  icp.setCameraIntrinsics(source->camera);
  icp.setInputSource(toPointCloud(*source));
  icp.setInputTarget(render(guess));
  icp.setVirtualDepthPose(guess);
  icp.setVirtualDepthRenderer(render);
  icp.setVisualCorrespondences(visual.source, visual.target, visual.weights);
  Cloud aligned;
  icp.align(aligned, guess.matrix().cast<float>());
  Alignment alignment;
  alignment.world_from_source = closestPose(icp.getFinalTransformation().cast<double>());
  alignment.result = icp.getResult();
  return alignment;
}

std::optional<VisualPose>
FrameRegistrar::initialPose(const VisualCorrespondences& visual,
                            std::size_t image,
                            const std::vector<int>& features,
                            ImageRegistration& report) const
{
  const std::optional<VisualPose> initial =
      options_.method == ImageRegistrationMethod::PNP
          ? estimatePnPPose(graph_.camera(), pixelsOf(graph_.features(image), features), visual.target)
          : estimateVisualPose(visual);
  report.matches = visual.source.size();
  report.inliers = initial ? initial->inliers : 0;
  if (report.inliers >= options_.min_visual_inliers)
    return initial;
  report.reason = "only " + std::to_string(report.inliers) + " of " +
                  std::to_string(report.matches) +
                  " visual correspondences agree on a pose; needed are " +
                  std::to_string(options_.min_visual_inliers);
  return std::nullopt;
}

FrameRegistration
FrameRegistrar::adjusted(const SparseModel& model,
                         std::size_t image,
                         const VisualCorrespondences& visual,
                         const std::vector<int>& features,
                         const DensePose& dense,
                         const ImageRegistration& report) const
{
  std::vector<PointObservation> observations;
  for (std::size_t k = 0; k < features.size(); ++k)
    observations.push_back({features[k], visual.target[k]});
  const ImagePose pose = adjustPose(graph_,
                                    model,
                                    image,
                                    observations,
                                    dense,
                                    options_.adjustment,
                                    depth_errors_,
                                    {dense.world_from_camera, model.depthError(image)});
  FrameRegistration registration{pose.world_from_camera, pose.depth_error, pose.covariance, report};
  const double rotation = largestDeviation(pose.covariance.topLeftCorner<3, 3>());
  const double position = largestDeviation(pose.covariance.bottomRightCorner<3, 3>());
  registration.report.rotation_deviation = rotation;
  registration.report.position_deviation = position;
  registration.report.registered = position <= options_.max_position_deviation &&
                                   rotation <= options_.max_rotation_deviation;
  if (!registration.report.registered) {
    std::ostringstream reason;
    reason << "its matches and its depth leave the pose open: +- " << std::setprecision(2)
           << 100 * position << " cm along, or +- " << rotation * 180 / M_PI
           << " degrees about, some direction";
    registration.report.reason = reason.str();
  }
  return registration;
}

/** Dense evidence is at best as good as the error that an image's pixels share. */
bool
FrameRegistrar::canDepthImprove(std::size_t image, const FrameRegistration& visual) const
{
  const double z = meanDepth(graph_.features(image));
  if (!(z > 0))
    return true;
  const SharedError shared(z, graph_.camera().depth_noise, shared_depth_sigmas_);
  const double rotation = visual.report.rotation_deviation / shared.tilt;
  const double position = visual.report.position_deviation / shared.shift;
  return rotation * rotation + position * position > LEAST_DENSE_GAIN;
}

FrameRegistration
FrameRegistrar::registerVisually(const SparseModel& model, std::size_t image, int component) const
{
  FrameRegistration registration;
  std::vector<int> features;
  const VisualCorrespondences visual = findCorrespondences(
      model, image, registeredNeighbours(model, image, component), features);
  const std::optional<VisualPose> initial =
      initialPose(visual, image, features, registration.report);
  if (!initial)
    return registration;
  return adjusted(
      model, image, visual, features, {initial->world_from_source}, registration.report);
}

FrameRegistration
FrameRegistrar::registerFrame(const SparseModel& model,
                              std::size_t image,
                              int component,
                              int num_threads) const
{
  FrameRegistration registration;
  ImageRegistration& report = registration.report;
  const std::vector<Neighbour> neighbours = registeredNeighbours(model, image, component);
  if (!options_.visual_start)
    return registerFrameByGeometry(
        model, image, neighbours, model.worldFromCamera(neighbours.front().image), num_threads);
  // Algorithm 1, lines 1 and 2: initial pose over all registered neighbours
  std::vector<int> features;
  const VisualCorrespondences visual = findCorrespondences(model, image, neighbours, features);
  const std::optional<VisualPose> initial = initialPose(visual, image, features, report);
  if (!initial)
    return registration;
  DensePose dense{initial->world_from_source};
  if (options_.method == ImageRegistrationMethod::BUNDLE_ICP) {
    if (!graph_.isKey(image)) {
      registration = adjusted(model, image, visual, features, dense, report);
      if (registration.report.registered && !canDepthImprove(image, registration))
        return registration;
    }
    // Lines 3 to 7: ICP against the virtual depth
    const Alignment alignment = alignToVirtualDepth(
        model, image, neighbours, visual, initial->world_from_source, num_threads);
    report.inliers = alignment.result.visual_inliers;
    report.icp_rmse = alignment.result.rmse;
    dense = {alignment.world_from_source * model.depthFromColor(image),
             withSharedError(alignment.result.information,
                             *depth_views_(image, model),
                             graph_.camera().depth_noise,
                             shared_depth_sigmas_,
                             1)};
  }
  return adjusted(model, image, visual, features, dense, report);
}

FrameRegistration
FrameRegistrar::registerFrameByGeometry(const SparseModel& model,
                                        std::size_t image,
                                        const std::vector<Neighbour>& neighbours,
                                        const Pose& guess,
                                        int num_threads) const
{
  FrameRegistration registration;
  ImageRegistration& report = registration.report;
  const Alignment alignment =
      alignToVirtualDepth(model, image, neighbours, {}, guess, num_threads);
  const BundleICPResult& result = alignment.result;
  report.by_geometry = true;
  report.icp_rmse = result.rmse;
  registration.world_from_camera = alignment.world_from_source * model.depthFromColor(image);
  registration.covariance = covarianceOf(withSharedError(result.information,
                                                         *depth_views_(image, model),
                                                         graph_.camera().depth_noise,
                                                         shared_depth_sigmas_,
                                                         1),
                                         registration.world_from_camera.translation());
  if (result.status != BundleICPStatus::CONVERGED)
    report.reason = "geometry alone did not converge";
  else if (result.overlap < options_.min_overlap)
    report.reason = "geometry alone: only " + std::to_string(int(100 * result.overlap)) +
                    " % of the depth lies on the model";
  else if (!result.degenerate_directions.empty())
    report.reason = "geometry alone leaves " +
                    std::to_string(result.degenerate_directions.size()) +
                    " directions of motion open";
  else
    report.registered = true;
  return registration;
}

Matrix6d
FrameRegistrar::poseCovariance(const SparseModel& model,
                               std::size_t image,
                               const std::vector<RelativePoseTerm>& terms) const
{
  DensePose dense{model.worldFromCamera(image)};
  for (const RelativePoseTerm& term : terms)
    if (term.first == image || term.second == image)
      dense.information += informationInWorld(term, model.worldFromCamera(term.first));
  std::vector<PointObservation> observations;
  for (std::size_t j = 0; j < graph_.features(image).size(); ++j)
    if (const int point = model.pointOf(image, int(j)); point >= 0)
      observations.push_back({int(j), model.points()[std::size_t(point)].position});
  return adjustPose(graph_,
                    model,
                    image,
                    observations,
                    dense,
                    options_.adjustment,
                    depth_errors_,
                    {model.worldFromCamera(image), model.depthError(image)})
      .covariance;
}

std::optional<RelativePoseTerm>
FrameRegistrar::registerPair(const SparseModel& model, std::size_t first, std::size_t second) const
{
  const std::shared_ptr<const DepthView> target = depth_views_(first, model);
  const std::shared_ptr<const DepthView> source = depth_views_(second, model);
  const Pose guess = model.worldFromDepth(first).inverse() * model.worldFromDepth(second);
  DenseBundleICP icp;
  icp.setNumberOfThreads(1);
  icp.setMaxMisalignment(0); // the poses are adjusted
  icp.setCameraIntrinsics(source->camera);
  icp.setInputSource(toPointCloud(*source));
  icp.setInputTarget(toPointCloud(*target));
  Cloud aligned;
  icp.align(aligned, guess.matrix().cast<float>());
  const BundleICPResult& result = icp.getResult();
  if (result.status != BundleICPStatus::CONVERGED || result.overlap < 0.2)
    return std::nullopt;
  RelativePoseTerm term;
  term.first = first;
  term.second = second;
  term.first_from_second = model.depthFromColor(first).inverse() *
                           closestPose(icp.getFinalTransformation().cast<double>()) *
                           model.depthFromColor(second);
  term.information = withSharedError(result.information,
                                     *source,
                                     graph_.camera().depth_noise,
                                     shared_depth_sigmas_,
                                     2);
  return term;
}

} // namespace bundle_icp
