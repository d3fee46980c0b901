// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/registration_by_time.h"

#include "common/by_time.h"
#include "mapping/frame_motions.h"

#include <algorithm>
#include <optional>

namespace bundle_icp {
namespace {

/** So many verified matches with frames elsewhere are not overruled by geometry alone. */
constexpr std::size_t MANY_MATCHES = 100;
/** An image with fewer features may match nothing although it shows what others show; so may one
 *  with less than this share of the features of a typical frame. */
constexpr std::size_t MANY_FEATURES = 100;
constexpr double USUAL_SHARE = 0.5;
/** Largest deviation of a start by the prior [m, rad]: twice as much is the error of a start by
 *  matches from which tracking still finds the pose. */
constexpr double MAX_START_DEVIATION = 0.05;

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

/** Where a frame may be, and the frames whose depth it is held against. */
struct Start {
  Pose world_from_camera = Pose::Identity();
  std::vector<Neighbour> neighbours;
};

/** Frames in an order of time, forwards or backwards, of which some have a pose. */
struct OrderedFrames {
  const ImageGraph& graph;
  const SparseModel& model;
  int component;
  const std::vector<std::size_t>& order;

  bool
  hasPose(std::size_t place) const
  {
    return model.component(order[place]) == component;
  }

  std::vector<Neighbour>
  neighboursAt(std::size_t place) const
  {
    std::vector<Neighbour> neighbours{{order[place], 0}};
    if (place > 0 && hasPose(place - 1))
      neighbours.push_back({order[place - 1], 0});
    return neighbours;
  }
};

/** By the prior, from the nearest frame before that has a pose; that may be some frames away. */
std::optional<Start>
startByPrior(const OrderedFrames& frames, const PriorMotions& prior, std::size_t place)
{
  std::size_t base = place;
  while (base > 0 && !frames.hasPose(base - 1))
    --base;
  if (base == 0)
    return std::nullopt;
  const std::size_t nearest = frames.order[--base];
  const auto motion = prior.between(nearest, frames.order[place]);
  if (!motion || motion->position_sigma > MAX_START_DEVIATION ||
      motion->rotation_sigma > MAX_START_DEVIATION)
    return std::nullopt;
  return Start{frames.model.worldFromCamera(nearest) * motion->first_from_second,
               frames.neighboursAt(base)};
}

/** As the camera moved before; from the frame before, if that has a pose. */
std::optional<Start>
startByMotion(const OrderedFrames& frames, std::size_t place)
{
  if (!frames.hasPose(place - 1))
    return std::nullopt;
  const std::size_t frame = frames.order[place], last = frames.order[place - 1];
  Start start{frames.model.worldFromCamera(last), frames.neighboursAt(place - 1)};
  if (start.neighbours.size() > 1)
    start.world_from_camera =
        extrapolatedPose(frames.graph, frames.model, start.neighbours.back().frame, last, frame);
  return start;
}

/** Each frame after those before it that have a pose: the first start that geometry confirms. */
void
registerInOrder(const ImageGraph& graph, const FrameRegistrar& registrar, int num_threads,
                const PriorMotions& prior, int component, const std::vector<std::size_t>& order,
                SparseModel& model, std::vector<FrameByTime>& tried)
{
  const std::size_t typical = typicalFeatures(graph, model.registeredFrames(component));
  const OrderedFrames frames{graph, model, component, order};
  for (std::size_t k = 1; k < order.size(); ++k) {
    const std::size_t frame = order[k];
    if (model.isRegistered(frame) || graph.exclusion(frame).rfind("blurred", 0) == 0 ||
        belongsElsewhere(graph, model, frame, component, typical))
      continue;
    FrameRegistration found;
    bool is_tried = false;
    for (const auto& start : {startByPrior(frames, prior, k), startByMotion(frames, k)})
      if (start && !found.registered) {
        is_tried = true;
        found = registrar.bundleICP(
            model, {frame, start->neighbours, start->world_from_camera, num_threads});
      }
    if (is_tried)
      tried.push_back({frame, found});
    if (found.registered)
      model.registerFrame(frame, found.world_from_camera, component);
  }
}

} // namespace

std::vector<FrameByTime>
registerByTime(const ImageGraph& graph, const FrameRegistrar& registrar,
               const MapperOptions& options, const PriorMotions& prior, int component,
               SparseModel& model)
{
  std::vector<FrameByTime> tried;
  if (!options.schedule.ordered_in_time ||
      options.registration.method != FrameRegistrationMethod::BUNDLE_ICP)
    return tried;
  std::vector<std::size_t> order = byTime(graph);
  registerInOrder(graph, registrar, options.num_threads, prior, component, order, model, tried);
  std::reverse(order.begin(), order.end());
  registerInOrder(graph, registrar, options.num_threads, prior, component, order, model, tried);
  return tried;
}

} // namespace bundle_icp
