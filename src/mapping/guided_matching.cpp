// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/guided_matching.h"

#include "common/array_store.h"
#include "common/parallel.h"
#include "model/measurement_model.h"

#include <opencv2/core.hpp>
#include <pcl/kdtree/impl/kdtree_flann.hpp>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <utility>

namespace bundle_icp {
namespace {

constexpr double SQUARED_NORM = 256 * 256;
/** Of 1 - cosine of two descriptors: less than what features of different points have. */
constexpr double MAX_DISTANCE = 0.25;
/** Looser than that of matching: there are few others within a few pixels. */
constexpr double SQUARED_RATIO = 0.85 * 0.85;
/** Sizes in space of two features of one point differ by at most this factor. */
constexpr double MAX_SIZE_RATIO = 2;
/** M_th of equation (5) holds for these pairs, too: fewer are chance. */
const std::size_t MIN_MATCHES = MatchingOptions().min_matches;
/** Cosine of the angle between frames that see the same from sides that SIFT bears. */
constexpr double MIN_COSINE = 0.5;
/** Pairs that are matched before the model takes their matches. */
constexpr std::size_t PAIRS_AT_ONCE = 4096;

/** The features of a frame that have a depth. */
struct View {
  std::vector<int> features;
  std::vector<Eigen::Vector3d> points;         ///< in the world
  pcl::KdTreeFLANN<pcl::PointXYZ> tree{false}; ///< of pixels
};

void
fill(const ImageGraph& graph, const SparseModel& model, std::size_t frame, View& view)
{
  const Features& features = graph.features(frame);
  pcl::PointCloud<pcl::PointXYZ>::Ptr pixels(new pcl::PointCloud<pcl::PointXYZ>);
  for (int j = 0; j < features.descriptors.rows; ++j)
    if (features.hasDepth(j)) {
      view.features.push_back(j);
      view.points.push_back(measuredPoint(graph, model, {frame, j}));
      pixels->push_back({features.pixels[j].x(), features.pixels[j].y(), 0});
    }
  if (!pixels->empty())
    view.tree.setInputCloud(pixels);
}

bool
haveSameSize(const Features& a, int i, const Features& b, int j)
{
  const double ratio =
      double(a.pixel_sigmas[i]) * a.depths[i] / (double(b.pixel_sigmas[j]) * b.depths[j]);
  return ratio < MAX_SIZE_RATIO && 1 / ratio < MAX_SIZE_RATIO;
}

/** The best match so far of a feature. */
struct Best {
  double product = -1;
  int feature = -1;
};

/** Candidate of the first frame that looks like feature j of the second; feature -1 = none does. */
Best
mostSimilar(const Features& first, const Features& second, int j, const pcl::Indices& candidates)
{
  int match = -1;
  double best = -1, runner_up = -1;
  for (const int i : candidates) {
    if (!haveSameSize(first, i, second, j))
      continue;
    const double similarity = first.descriptors.row(i).dot(second.descriptors.row(j));
    if (similarity > best) {
      match = i;
      runner_up = std::exchange(best, similarity);
    }
    else
      runner_up = std::max(runner_up, similarity);
  }
  const double distance = 1 - best / SQUARED_NORM, next = 1 - runner_up / SQUARED_NORM;
  if (distance > MAX_DISTANCE || (runner_up >= 0 && distance > SQUARED_RATIO * next))
    match = -1;
  return {best, match};
}

std::vector<FeatureMatch>
toMatches(const std::vector<Best>& best)
{
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < best.size(); ++i)
    if (best[i].feature >= 0)
      matches.push_back({int(i), best[i].feature});
  if (matches.size() < MIN_MATCHES)
    matches.clear();
  return matches;
}

std::vector<FeatureMatch>
matchViews(const ImageGraph& graph, const SparseModel& model,
           std::pair<std::size_t, std::size_t> frames, const View& first_view,
           const View& second_view, double max_pixel_error)
{
  const Features &first = graph.features(frames.first), &second = graph.features(frames.second);
  const MeasurementModel measurement(graph.camera(), model.calibration().values,
                                     model.motion(frames.first));
  const Pose first_from_world = model.worldFromCamera(frames.first).inverse();
  std::vector<Best> best(first.size());
  pcl::Indices found;
  std::vector<float> squared_distances;
  for (std::size_t k = 0; k < second_view.features.size(); ++k) {
    const Eigen::Vector3d point = first_from_world * second_view.points[k];
    if (!(point.z() > 0))
      continue;
    const double row = graph.camera().fy * point.y() / point.z() + graph.camera().cy;
    const Eigen::Vector2f pixel = measurement.pixel(point, row).cast<float>();
    const int j = second_view.features[k];
    const double radius = max_pixel_error * std::max(1.0f, second.pixel_sigmas[j]);
    if (!pixel.allFinite() || first_view.tree.radiusSearch({pixel.x(), pixel.y(), 0}, radius, found,
                                                           squared_distances) == 0)
      continue;
    for (int& i : found)
      i = first_view.features[i];
    const Best similar = mostSimilar(first, second, j, found);
    if (similar.feature >= 0 && similar.product > best[similar.feature].product)
      best[similar.feature] = {similar.product, j};
  }
  return toMatches(best);
}

bool
shareEdge(const ImageGraph& graph, std::size_t a, std::size_t b)
{
  const std::vector<ImageEdge> edges = graph.edges(a);
  return std::any_of(edges.begin(), edges.end(),
                     [b](const ImageEdge& edge) { return edge.neighbour == b; });
}

} // namespace

void
matchByPrediction(const ImageGraph& graph, const std::vector<std::size_t>& frames,
                  const TrackOptions& options, int num_threads, SparseModel& model)
{
  std::vector<View> views(frames.size());
  parallelFor(frames.size(), num_threads, {},
              [&](std::size_t k) { fill(graph, model, frames[k], views[k]); });
  const auto axis = [&](std::size_t k) -> Eigen::Vector3d {
    return model.worldFromCamera(frames[k]).linear().col(2);
  };
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < frames.size(); ++a)
    for (std::size_t b = a + 1; b < frames.size(); ++b)
      if (!views[a].features.empty() && axis(a).dot(axis(b)) > MIN_COSINE &&
          !shareEdge(graph, frames[a], frames[b]))
        pairs.emplace_back(a, b);
  for (std::size_t begin = 0; begin < pairs.size(); begin += PAIRS_AT_ONCE) {
    const std::size_t count = std::min(PAIRS_AT_ONCE, pairs.size() - begin);
    std::vector<std::vector<FeatureMatch>> slots(count);
    parallelFor(count, num_threads, {}, [&](std::size_t k) {
      const auto [a, b] = pairs[begin + k];
      slots[k] = matchViews(graph, model, {frames[a], frames[b]}, views[a], views[b],
                            options.max_pixel_error);
    });
    for (std::size_t k = 0; k < count; ++k) {
      const auto [a, b] = pairs[begin + k];
      model.joinMatches(graph, frames[a], frames[b], slots[k], options);
    }
  }
  for (const std::size_t frame : frames)
    releaseMemory(graph.features(frame).descriptors);
}

} // namespace bundle_icp
