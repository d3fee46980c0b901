// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/registration_by_time.h"

#include "mapping/frame_motions.h"

#include <algorithm>
#include <numeric>

namespace bundle_icp {
namespace {

/** So many verified matches with frames elsewhere are not overruled by geometry alone. */
constexpr std::size_t MANY_MATCHES = 100;
/** An image with fewer features may match nothing although it shows what others show; so may one
 *  with less than this share of the features of a typical frame. */
constexpr std::size_t MANY_FEATURES = 100;
constexpr double USUAL_SHARE = 0.5;

std::size_t
typicalFeatures(const ImageGraph& graph, const std::vector<std::size_t>& frames)
{
  std::vector<std::size_t> numbers;
  for (const std::size_t frame : frames)
    numbers.push_back(graph.features(frame).size());
  std::sort(numbers.begin(), numbers.end());
  return numbers.empty() ? 0 : numbers[numbers.size() / 2];
}

/** Whether a frame's matches say that it belongs to frames outside of the component, or its
 *  features, which match nothing there: it shows something else, or its depth is not of its
 *  image. */
bool
belongsElsewhere(const ImageGraph& graph, const SparseModel& model, std::size_t frame,
                 int component, std::size_t typical_features)
{
  std::size_t inside = 0, outside = 0;
  for (const ImageEdge& edge : graph.edges(frame)) {
    std::size_t& most = model.component(edge.neighbour) == component ? inside : outside;
    most = std::max(most, edge.pair->matches.size());
  }
  const std::size_t features = graph.features(frame).size();
  const bool has_features =
      features >= MANY_FEATURES && double(features) >= USUAL_SHARE * double(typical_features);
  return (outside >= MANY_MATCHES && outside > inside) || (inside == 0 && has_features);
}

/** Each frame after the one before it, if that has a pose. */
void
registerInOrder(const ImageGraph& graph, const FrameRegistrar& registrar, int num_threads,
                int component, const std::vector<std::size_t>& order, SparseModel& model,
                std::vector<FrameByTime>& tried)
{
  const std::size_t typical = typicalFeatures(graph, model.registeredFrames(component));
  for (std::size_t k = 1; k < order.size(); ++k) {
    const std::size_t frame = order[k], last = order[k - 1];
    if (model.isRegistered(frame) || model.component(last) != component ||
        graph.exclusion(frame).rfind("blurred", 0) == 0 ||
        belongsElsewhere(graph, model, frame, component, typical))
      continue;
    Pose guess = model.worldFromCamera(last);
    std::vector<Neighbour> neighbours{{last, 0}};
    if (k >= 2 && model.component(order[k - 2]) == component) {
      guess = extrapolatedPose(graph, model, order[k - 2], last, frame);
      neighbours.push_back({order[k - 2], 0});
    }
    const FrameRegistration registration =
        registrar.bundleICP(model, {frame, neighbours, guess, num_threads});
    tried.push_back({frame, registration});
    if (registration.registered)
      model.registerFrame(frame, registration.world_from_camera, component);
  }
}

} // namespace

std::vector<FrameByTime>
registerByTime(const ImageGraph& graph, const FrameRegistrar& registrar,
               const MapperOptions& options, int component, SparseModel& model)
{
  std::vector<FrameByTime> tried;
  if (!options.schedule.ordered_in_time ||
      options.registration.method != FrameRegistrationMethod::BUNDLE_ICP)
    return tried;
  std::vector<std::size_t> all(graph.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::size_t> order = byTime(graph, std::move(all));
  registerInOrder(graph, registrar, options.num_threads, component, order, model, tried);
  std::reverse(order.begin(), order.end());
  registerInOrder(graph, registrar, options.num_threads, component, order, model, tried);
  return tried;
}

} // namespace bundle_icp
