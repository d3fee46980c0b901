// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "sparse/frame_registration.h"

#include "sparse/pnp_pose.h"
#include "sparse/pose_adjustment.h"

#include <algorithm>
#include <set>

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

} // namespace

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
      visual.source.push_back(pointInCamera(features, own, camera));
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
  const std::shared_ptr<const DepthView> source = depth_views_(image);
  std::vector<std::shared_ptr<const DepthView>> held;
  std::vector<RegisteredView> views;
  for (const Neighbour& neighbour : neighbours) {
    if (views.size() == options_.max_views)
      break;
    held.push_back(depth_views_(neighbour.image));
    views.push_back({held.back().get(), model.worldFromCamera(neighbour.image)});
  }
  VirtualDepthOptions rendering = options_.virtual_depth;
  rendering.num_threads = num_threads;
  const auto render = [&](const Pose& world_from_virtual) -> Cloud::Ptr {
    return toPointCloud(renderVirtualDepth(views, source->camera, world_from_virtual, rendering));
  };

  DenseBundleICP icp;
  icp.setNumberOfThreads(num_threads);
  icp.setDepthNoise(rendering.noise);
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
  report.matches = visual.source.size();
  const std::optional<VisualPose> initial =
      options_.method == ImageRegistrationMethod::PNP
          ? estimatePnPPose(graph_.camera(), pixelsOf(graph_.features(image), features), visual.target)
          : estimateVisualPose(visual);
  report.inliers = initial ? initial->inliers : 0;
  if (report.inliers < options_.min_visual_inliers) {
    report.reason = "only " + std::to_string(report.inliers) + " of " +
                    std::to_string(report.matches) +
                    " visual correspondences agree on a pose; needed are " +
                    std::to_string(options_.min_visual_inliers);
    return registration;
  }
  report.registered = true;
  DensePose dense{initial->world_from_source};
  if (options_.method == ImageRegistrationMethod::BUNDLE_ICP) {
    // Lines 3 to 7: ICP against the virtual depth
    const Alignment alignment = alignToVirtualDepth(
        model, image, neighbours, visual, initial->world_from_source, num_threads);
    report.inliers = alignment.result.visual_inliers;
    report.icp_rmse = alignment.result.rmse;
    dense = {alignment.world_from_source, options_.dense_weight * alignment.result.information};
  }
  std::vector<PointObservation> observations;
  for (std::size_t k = 0; k < features.size(); ++k)
    observations.push_back({features[k], visual.target[k]});
  registration.world_from_camera = adjustPose(graph_.features(image),
                                              graph_.camera(),
                                              observations,
                                              dense,
                                              options_.adjustment,
                                              dense.world_from_camera);
  return registration;
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
  registration.world_from_camera = alignment.world_from_source;
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

std::optional<RelativePoseTerm>
FrameRegistrar::registerPair(const SparseModel& model, std::size_t first, std::size_t second) const
{
  const std::shared_ptr<const DepthView> target = depth_views_(first);
  const std::shared_ptr<const DepthView> source = depth_views_(second);
  const Pose guess = model.worldFromCamera(first).inverse() * model.worldFromCamera(second);
  DenseBundleICP icp;
  icp.setNumberOfThreads(1);
  icp.setDepthNoise(options_.virtual_depth.noise);
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
  term.first_from_second = closestPose(icp.getFinalTransformation().cast<double>());
  term.information = options_.dense_weight * result.information;
  return term;
}

} // namespace bundle_icp
