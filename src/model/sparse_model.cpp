// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/model/sparse_model.h>

#include "model/measurement_model.h"

#include <algorithm>
#include <set>
#include <utility>

namespace bundle_icp {

bool
TrackOptions::isValid(std::string* error) const
{
  if (max_sigmas > 0 && max_pixel_error > 0)
    return true;
  if (error)
    *error = "max_sigmas and max_pixel_error must be > 0";
  return false;
}

SparseModel::SparseModel(std::size_t num_frames) : frames_(num_frames)
{
}

void
SparseModel::resize(std::size_t num_frames)
{
  frames_.resize(num_frames);
}

std::vector<std::size_t>
SparseModel::registeredFrames(int component) const
{
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (isRegistered(i) && (component < 0 || frames_[i].component == component))
      result.push_back(i);
  return result;
}

void
SparseModel::registerFrame(std::size_t frame, const Pose& world_from_camera, int component)
{
  frames_[frame].world_from_camera = world_from_camera;
  frames_[frame].component = component;
}

void
SparseModel::registerFrame(const ImageGraph& graph, std::size_t frame,
                           const Pose& world_from_camera, int component,
                           const TrackOptions& options)
{
  registerFrame(frame, world_from_camera, component);
  extendTracks(graph, frame, options);
}

void
SparseModel::removeFrame(std::size_t frame)
{
  for (std::size_t feature = 0; feature < frames_[frame].points.size(); ++feature)
    if (frames_[frame].points[feature] >= 0)
      removeObservation({frame, int(feature)});
  registerFrame(frame, Pose::Identity(), -1);
}

void
SparseModel::extendTracks(const ImageGraph& graph, std::size_t frame, const TrackOptions& options)
{
  frames_[frame].points.resize(graph.features(frame).size(), -1);
  for (const ImageEdge& edge : graph.edges(frame)) {
    if (component(edge.neighbour) != component(frame) || frames_[edge.neighbour].points.empty())
      continue;
    const bool is_first = edge.pair->first == frame;
    for (const FeatureMatch& match : edge.pair->matches)
      joinMatch(graph, {frame, is_first ? match.first : match.second},
                {edge.neighbour, is_first ? match.second : match.first}, options);
  }
}

void
SparseModel::joinMatches(const ImageGraph& graph, std::size_t first, std::size_t second,
                         const std::vector<FeatureMatch>& matches, const TrackOptions& options)
{
  if (frames_[first].points.empty() || frames_[second].points.empty())
    return;
  for (const FeatureMatch& match : matches)
    joinMatch(graph, {first, match.first}, {second, match.second}, options);
}

void
SparseModel::rebuildTracks(const ImageGraph& graph, int component, const TrackOptions& options)
{
  for (ScenePoint& point : points_)
    if (!point.track.empty() && frames_[point.track.front().frame].component == component)
      point.track.clear();
  std::vector<std::size_t> with_tracks;
  for (const std::size_t frame : registeredFrames(component))
    if (!std::exchange(frames_[frame].points, {}).empty())
      with_tracks.push_back(frame);
  for (const std::size_t frame : with_tracks)
    extendTracks(graph, frame, options);
}

void
SparseModel::joinMatch(const ImageGraph& graph, const Observation& added, const Observation& known,
                       const TrackOptions& options)
{
  const int own = pointOf(added.frame, added.feature);
  const int other = pointOf(known.frame, known.feature);
  if (own >= 0 && own == other)
    return;
  if (own >= 0 && other >= 0) {
    // Two tracks turn out to be one point, as they do when a loop closes.
    if (agrees(graph, *this, added, points_[other].position, options) &&
        agrees(graph, *this, known, points_[own].position, options))
      mergePoints(other, own);
    return;
  }
  if (own >= 0 || other >= 0) {
    const int point = own >= 0 ? own : other;
    const Observation& joining = own >= 0 ? known : added;
    const auto& track = points_[point].track;
    const bool seen = std::any_of(track.begin(), track.end(),
                                  [&](const Observation& o) { return o.frame == joining.frame; });
    if (!seen && agrees(graph, *this, joining, points_[point].position, options))
      addObservation(graph, point, joining);
    return;
  }
  const Eigen::Vector3d middle =
      0.5 * (measuredPoint(graph, *this, added) + measuredPoint(graph, *this, known));
  if (!agrees(graph, *this, added, middle, options) ||
      !agrees(graph, *this, known, middle, options))
    return;
  points_.push_back({});
  addObservation(graph, int(points_.size()) - 1, known);
  addObservation(graph, int(points_.size()) - 1, added);
}

void
SparseModel::addObservation(const ImageGraph& graph, int point, const Observation& observation)
{
  ScenePoint& p = points_[point];
  p.track.push_back(observation);
  // Running mean: good enough to start the adjustment from.
  p.position += (measuredPoint(graph, *this, observation) - p.position) / double(p.track.size());
  frames_[observation.frame].points[observation.feature] = point;
}

void
SparseModel::mergePoints(int into, int from)
{
  ScenePoint &kept = points_[into], &dropped = points_[from];
  std::set<std::size_t> seen;
  for (const Observation& o : kept.track)
    seen.insert(o.frame);
  for (const Observation& o : dropped.track)
    if (seen.count(o.frame))
      return; // a frame cannot see one point twice
  const double share = dropped.track.size() / double(kept.track.size() + dropped.track.size());
  kept.position += share * (dropped.position - kept.position);
  for (const Observation& o : dropped.track) {
    kept.track.push_back(o);
    frames_[o.frame].points[o.feature] = into;
  }
  dropped.track.clear();
}

std::size_t
SparseModel::visibility(const ImageGraph& graph, std::size_t frame, int component) const
{
  std::vector<char> visible(graph.features(frame).size(), 0);
  for (const ImageEdge& edge : graph.edges(frame)) {
    if (frames_[edge.neighbour].component != component)
      continue;
    const bool is_first = edge.pair->first == frame;
    for (const FeatureMatch& match : edge.pair->matches)
      if (pointOf(edge.neighbour, is_first ? match.second : match.first) >= 0)
        visible[is_first ? match.first : match.second] = 1;
  }
  return std::size_t(std::count(visible.begin(), visible.end(), 1));
}

int
SparseModel::pointOf(std::size_t frame, int feature) const
{
  const std::vector<int>& points = frames_[frame].points;
  return points.empty() ? -1 : points[feature];
}

void
SparseModel::removeObservation(const Observation& observation)
{
  int& point = frames_[observation.frame].points[observation.feature];
  auto& track = points_[point].track;
  track.erase(std::find_if(track.begin(), track.end(), [&](const Observation& o) {
    return o.frame == observation.frame && o.feature == observation.feature;
  }));
  point = -1;
}

std::size_t
SparseModel::removeOutliers(const ImageGraph& graph, const TrackOptions& options)
{
  std::size_t removed = 0;
  for (ScenePoint& point : points_) {
    const std::vector<Observation> track = point.track;
    for (const Observation& o : track)
      if (!agrees(graph, *this, o, point.position, options)) {
        removeObservation(o);
        ++removed;
      }
    if (point.track.size() == 1) {
      removeObservation(Observation(point.track.front()));
      ++removed;
    }
  }
  return removed;
}

void
SparseModel::transform(int component, const Pose& new_from_old)
{
  for (Frame& frame : frames_)
    if (frame.component == component)
      frame.world_from_camera = new_from_old * frame.world_from_camera;
  for (ScenePoint& point : points_)
    if (!point.track.empty() && frames_[point.track.front().frame].component == component)
      point.position = new_from_old * point.position;
}

Eigen::Vector3d
measuredPointInCamera(const ImageGraph& graph, const SparseModel& model,
                      const Observation& observation)
{
  const Features& features = graph.features(observation.frame);
  const std::size_t j = std::size_t(observation.feature);
  const CameraIntrinsics& camera = graph.camera();
  const Eigen::Vector2d pixel = features.pixels[j].cast<double>();
  const Calibration& calibration = model.calibration();
  const Eigen::Vector2d shift(calibration[CalibrationParameter::DEPTH_SHIFT_X],
                              calibration[CalibrationParameter::DEPTH_SHIFT_Y]);
  const double z =
      correctedDepth(features.depths[j] + features.depthSlope(j).cast<double>().dot(shift),
                     (pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy,
                     calibration, model.depthError(observation.frame), graph.camera().depth_noise);
  const MeasurementModel measurement(camera, calibration.values, model.motion(observation.frame));
  return measurement.unproject(pixel, z);
}

Eigen::Vector3d
measuredPoint(const ImageGraph& graph, const SparseModel& model, const Observation& observation)
{
  return model.worldFromCamera(observation.frame) *
         measuredPointInCamera(graph, model, observation);
}

bool
agrees(const ImageGraph& graph, const SparseModel& model, const Observation& observation,
       const Eigen::Vector3d& point, const TrackOptions& options)
{
  const Features& features = graph.features(observation.frame);
  const std::size_t j = std::size_t(observation.feature);
  const Eigen::Vector3d in_camera = model.worldFromCamera(observation.frame).inverse() * point;
  if (!(in_camera.z() > 0))
    return false;
  const Eigen::Vector2d pixel = features.pixels[j].cast<double>();
  const MeasurementModel measurement(graph.camera(), model.calibration().values,
                                     model.motion(observation.frame));
  const double pixel_error = (measurement.pixel(in_camera, pixel.y()) - pixel).norm();
  const double depth_error =
      std::abs(measurement.depth(in_camera, pixel, model.depthError(observation.frame),
                                 graph.camera().depth_noise) -
               features.depths[j]);
  return pixel_error < options.max_pixel_error * std::max(1.0f, features.pixel_sigmas[j]) &&
         depth_error < options.max_sigmas * features.depth_sigmas[j];
}

} // namespace bundle_icp
