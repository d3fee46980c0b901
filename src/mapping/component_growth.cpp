// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/component_growth.h"

#include "adjustment/pose_adjustment.h"
#include "common/parallel.h"
#include "refinement/false_connections.h"

#include <algorithm>

namespace bundle_icp {
namespace {

/** Frames that hold a local adjustment in place. */
constexpr std::size_t NUM_HELD = 10;
/** Rounds of growth and correction of a component. */
constexpr int MAX_CORRECTIONS = 4;

} // namespace

/** First pair: the strongest edge of the frame with the highest Cor. */
bool
ComponentGrowth::initialise(SparseModel& model)
{
  const auto is_free = [&](std::size_t i) {
    return !model.isRegistered(i) && graph_.isKey(i) && graph_.exclusion(i).empty();
  };
  std::vector<std::size_t> seeds;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (is_free(i))
      seeds.push_back(i);
  std::stable_sort(seeds.begin(), seeds.end(), [this](std::size_t a, std::size_t b) {
    return graph_.correspondences(a) > graph_.correspondences(b);
  });
  for (const std::size_t seed : seeds) {
    ImageEdge strongest;
    for (const ImageEdge& edge : graph_.edges(seed))
      if (is_free(edge.neighbour) &&
          (!strongest.pair || edge.pair->matches.size() > strongest.pair->matches.size()))
        strongest = edge;
    if (!strongest.pair)
      continue;
    model.registerFrame(graph_, seed, Pose::Identity(), state_.component, options_.tracks);
    const FrameRegistration second =
        registrar_.bundleICP(model, registrar_.newFrame(model, strongest.neighbour,
                                                        state_.component, options_.num_threads));
    if (!second.registered) {
      model.registerFrame(seed, Pose::Identity(), -1);
      continue;
    }
    state_.registrations[seed] = state_.registrations[strongest.neighbour] = second;
    model.registerFrame(graph_, strongest.neighbour, second.world_from_camera, state_.component,
                        options_.tracks);
    state_.visibility.assign(graph_.size(), 0);
    updateVisibility(model, seed);
    updateVisibility(model, strongest.neighbour);
    return true;
  }
  return false;
}

/** Registering a frame changes the visibility of those that it shares an edge with. */
void
ComponentGrowth::updateVisibility(const SparseModel& model, std::size_t frame)
{
  for (const ImageEdge& edge : graph_.edges(frame))
    if (!model.isRegistered(edge.neighbour))
      state_.visibility[edge.neighbour] =
          model.visibility(graph_, edge.neighbour, state_.component);
}

/** The frames of highest visibility, best first, at most a batch. */
std::vector<std::size_t>
ComponentGrowth::nextFrames(const SparseModel& model, bool keys_only) const
{
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i) && !state_.growth.failed[i] && state_.visibility[i] > 0 &&
        (!keys_only || graph_.isKey(i)) && graph_.exclusion(i).empty())
      frames.push_back(i);
  std::stable_sort(frames.begin(), frames.end(), [this](std::size_t a, std::size_t b) {
    return state_.visibility[a] > state_.visibility[b];
  });
  std::size_t count = std::min(options_.schedule.batch_size, frames.size());
  // A frame that is much better connected should not wait for the others' failures, nor they
  // be tried before it has extended the model.
  while (count > 1 && 2 * state_.visibility[frames[count - 1]] < state_.visibility[frames[0]])
    --count;
  frames.resize(count);
  return frames;
}

/** Bundle ICP for frames that are independent of each other. */
std::vector<FrameRegistration>
ComponentGrowth::registerFrames(const SparseModel& model,
                                const std::vector<std::size_t>& frames) const
{
  std::vector<FrameRegistration> slots(frames.size());
  const int inner = frames.size() == 1 ? options_.num_threads : 1;
  parallelFor(frames.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] =
        registrar_.bundleICP(model, registrar_.newFrame(model, frames[k], state_.component, inner));
  });
  return slots;
}

/** Adds a frame with its points and updates V. */
void
ComponentGrowth::addToModel(SparseModel& model, std::size_t frame,
                            const FrameRegistration& registration)
{
  state_.registrations[frame] = registration;
  state_.growth.failed[frame] = !registration.registered;
  if (state_.growth.failed[frame])
    return;
  if (graph_.isKey(frame))
    model.registerFrame(graph_, frame, registration.world_from_camera, state_.component,
                        options_.tracks);
  else {
    model.registerFrame(frame, registration.world_from_camera, state_.component);
    state_.covariances[frame] = registration.covariance;
  }
  model.setDepthError(frame, registration.depth_error);
  updateVisibility(model, frame);
}

/** Adjusts the frames around the new frames, and all frames each time that the model has grown by
 *  MappingSchedule::adjustment_growth. */
void
ComponentGrowth::adjust(SparseModel& model, const std::vector<std::size_t>& added)
{
  std::vector<std::size_t> keys;
  for (const std::size_t frame : added)
    if (model.isRegistered(frame) && graph_.isKey(frame))
      keys.push_back(frame);
  if (keys.empty())
    return;
  BundleAdjustmentOptions local = options_.adjustment;
  local.max_iterations = ComponentAdjuster::INTERMEDIATE_ITERATIONS;
  adjustLocally(graph_, keys, NUM_HELD, local, model);
  const double size = double(model.registeredFrames(state_.component).size());
  if (size < state_.growth.next_adjustment)
    return;
  adjuster_.adjustInBetween(model, state_.component);
  updateVisibilities(model);
  state_.growth.next_adjustment = size * options_.schedule.adjustment_growth;
}

void
ComponentGrowth::begin(const SparseModel& model)
{
  state_.growth = {};
  state_.growth.failed.assign(graph_.size(), 0);
  state_.growth.size_at_failure = model.registeredFrames(state_.component).size();
}

bool
ComponentGrowth::addFrames(SparseModel& model, bool keys_only, const Step& step)
{
  GrowthState& growth = state_.growth;
  while (true) {
    // The next frames, by visibility V
    const std::vector<std::size_t> next = nextFrames(model, keys_only);
    if (next.empty()) {
      // Put back and tried again, once the model has grown
      const std::size_t size = model.registeredFrames(state_.component).size();
      if (size == growth.size_at_failure)
        return true;
      growth.size_at_failure = size;
      growth.failed.assign(graph_.size(), 0);
      continue;
    }
    const std::vector<FrameRegistration> registered = registerFrames(model, next);
    for (std::size_t k = 0; k < next.size(); ++k)
      addToModel(model, next[k], registered[k]);
    adjust(model, next);
    if (!step())
      return false;
  }
}

bool
ComponentGrowth::addKeyFrames(SparseModel& model, const Step& step)
{
  while (state_.growth.round < MAX_CORRECTIONS) {
    if (!addFrames(model, true, step))
      return false;
    if (correctFalseConnections(graph_, state_.component, options_.tracks, options_.num_threads,
                                model) == 0)
      break;
    // What was registered from a wrong place is adjusted to the right one, and frames that found no
    // place between the two may find it now.
    adjuster_.adjustInBetween(model, state_.component);
    updateVisibilities(model);
    const int round = state_.growth.round + 1;
    begin(model);
    state_.growth.round = round;
  }
  return true;
}

/** An adjustment may have changed the tracks of all frames. */
void
ComponentGrowth::updateVisibilities(const SparseModel& model)
{
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i))
      state_.visibility[i] = model.visibility(graph_, i, state_.component);
}

} // namespace bundle_icp
