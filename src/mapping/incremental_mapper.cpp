// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/mapping/incremental_mapper.h>

#include "adjustment/pose_adjustment.h"
#include "common/parallel.h"
#include "mapping/component_adjustment.h"
#include "mapping/registration_by_time.h"
#include "refinement/false_connections.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace bundle_icp {
namespace {

/** Frames that hold a local adjustment in place. */
constexpr std::size_t NUM_HELD = 10;
/** A component of so many frames is adjusted for the first time. */
constexpr double FIRST_ADJUSTMENT = 8;
/** Rounds of growth and correction of a component. */
constexpr int MAX_CORRECTIONS = 4;

} // namespace

class IncrementalMapper::Impl {
public:
  Impl(const ImageGraph& graph, DepthViewProvider depth_views, const MapperOptions& options)
  : registrations_(graph.size()), graph_(graph), depth_views_(std::move(depth_views)),
    options_(withThreads(options)),
    registrar_(graph_, depth_views_, options_.registration, options_.adjustment),
    visibility_(graph.size()), covariances_(graph.size()), adjuster_(graph_, registrar_, options_)
  {
  }

  bool
  run(SparseModel& model, const ProgressCallback& progress);

  const SelfCalibrationResult&
  selfCalibration() const
  {
    return adjuster_.selfCalibration();
  }

  std::vector<FrameRegistration> registrations_;
  PosePriorReport pose_prior_;

private:
  static MapperOptions
  withThreads(MapperOptions options)
  {
    options.adjustment.num_threads = options.num_threads;
    return options;
  }
  bool
  registerComponents(SparseModel& model);
  bool
  initialise(SparseModel& model, int component);
  bool
  growKeyFrames(SparseModel& model, int component);
  bool
  grow(SparseModel& model, int component, bool keys_only);
  std::vector<std::size_t>
  nextFrames(const SparseModel& model, bool keys_only) const;
  std::vector<FrameRegistration>
  registerFrames(const SparseModel& model, const std::vector<std::size_t>& frames,
                 int component) const;
  void
  addToModel(SparseModel& model, std::size_t frame, const FrameRegistration& registration,
             int component);
  void
  adjust(SparseModel& model, const std::vector<std::size_t>& added, int component,
         double& next_adjustment);
  void
  updateVisibility(const SparseModel& model, std::size_t frame, int component);
  void
  updateVisibilities(const SparseModel& model, int component);
  bool
  report(const SparseModel& model) const;

  const ImageGraph& graph_;
  const DepthViewProvider depth_views_;
  const MapperOptions options_;
  FrameRegistrar registrar_;
  /** V of equation (4) for the component that grows. */
  std::vector<std::size_t> visibility_;
  std::vector<char> failed_;
  /** Of poses that were found on their own, not adjusted with the others. */
  std::vector<std::optional<Matrix6d>> covariances_;
  ComponentAdjuster adjuster_;
  ProgressCallback progress_;
  bool was_run_ = false;
};

IncrementalMapper::IncrementalMapper(const ImageGraph& graph, DepthViewProvider depth_views,
                                     const MapperOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("IncrementalMapper: " + error);
  if (!depth_views)
    throw BadArgumentException("IncrementalMapper: no provider of depth views");
  const DepthViewProvider checked =
      [depth_views = std::move(depth_views)](std::size_t frame, const SparseModel& model) {
        auto view = depth_views(frame, model);
        if (!view)
          throw BadArgumentException("IncrementalMapper: no depth view of frame " +
                                     std::to_string(frame));
        return view;
      };
  impl_ = std::make_unique<Impl>(graph, checked, options);
}

IncrementalMapper::~IncrementalMapper() = default;

bool
IncrementalMapper::run(SparseModel& model, const ProgressCallback& progress)
{
  return impl_->run(model, progress);
}

const SelfCalibrationResult&
IncrementalMapper::selfCalibration() const
{
  return impl_->selfCalibration();
}

const PosePriorReport&
IncrementalMapper::posePrior() const
{
  return impl_->pose_prior_;
}

const std::vector<FrameRegistration>&
IncrementalMapper::registrations() const
{
  return impl_->registrations_;
}

bool
IncrementalMapper::Impl::run(SparseModel& model, const ProgressCallback& progress)
{
  if (std::exchange(was_run_, true))
    throw BadArgumentException("IncrementalMapper: run() was called before; a mapper runs once");
  progress_ = progress;
  model.resize(graph_.size());
  model.setCalibration(options_.refinement.calibration);
  for (std::size_t i = 0; i < graph_.size(); ++i)
    registrations_[i].reason = graph_.exclusion(i);
  const bool completed = registerComponents(model);
  numberBySize(model);
  return completed;
}

bool
IncrementalMapper::Impl::registerComponents(SparseModel& model)
{
  for (int component = 0; initialise(model, component); ++component) {
    if (!growKeyFrames(model, component))
      return false;
    adjuster_.calibrate(model, component);
    adjuster_.adjustFinally(model, component);
    updateVisibilities(model, component);
    if (component == 0 || adjuster_.prior().report().motions > pose_prior_.motions)
      pose_prior_ = adjuster_.prior().report();
    // Frames that only look like others: registered against the finished model
    if (!grow(model, component, false))
      return false;
    for (const auto& [frame, registration] :
         registerByTime(graph_, registrar_, options_, adjuster_.prior(), component, model)) {
      registrations_[frame] = registration;
      if (registration.registered)
        covariances_[frame] = registration.covariance;
    }
    for (const auto& [frame, covariance] :
         adjuster_.applyMotionPrior(model, component, covariances_)) {
      FrameRegistration& registration = registrations_[frame];
      registration.covariance = covariance;
      registration.rotation_deviation = largestDeviation(covariance.topLeftCorner<3, 3>());
      registration.position_deviation = largestDeviation(covariance.bottomRightCorner<3, 3>());
    }
  }
  return true;
}

bool
IncrementalMapper::Impl::report(const SparseModel& model) const
{
  return !progress_ || progress_({"registration", model.registeredFrames().size(), graph_.size()});
}

/** First pair: the strongest edge of the frame with the highest Cor. */
bool
IncrementalMapper::Impl::initialise(SparseModel& model, int component)
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
    model.registerFrame(graph_, seed, Pose::Identity(), component, options_.tracks);
    const FrameRegistration second = registrar_.bundleICP(
        model, registrar_.newFrame(model, strongest.neighbour, component, options_.num_threads));
    if (!second.registered) {
      model.registerFrame(seed, Pose::Identity(), -1);
      continue;
    }
    registrations_[seed] = registrations_[strongest.neighbour] = second;
    model.registerFrame(graph_, strongest.neighbour, second.world_from_camera, component,
                        options_.tracks);
    visibility_.assign(graph_.size(), 0);
    updateVisibility(model, seed, component);
    updateVisibility(model, strongest.neighbour, component);
    return true;
  }
  return false;
}

/** Registering a frame changes the visibility of those that it shares an edge with. */
void
IncrementalMapper::Impl::updateVisibility(const SparseModel& model, std::size_t frame,
                                          int component)
{
  for (const ImageEdge& edge : graph_.edges(frame))
    if (!model.isRegistered(edge.neighbour))
      visibility_[edge.neighbour] = model.visibility(graph_, edge.neighbour, component);
}

/** The frames of highest visibility, best first, at most a batch. */
std::vector<std::size_t>
IncrementalMapper::Impl::nextFrames(const SparseModel& model, bool keys_only) const
{
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i) && !failed_[i] && visibility_[i] > 0 &&
        (!keys_only || graph_.isKey(i)) && graph_.exclusion(i).empty())
      frames.push_back(i);
  std::stable_sort(frames.begin(), frames.end(), [this](std::size_t a, std::size_t b) {
    return visibility_[a] > visibility_[b];
  });
  std::size_t count = std::min(options_.schedule.batch_size, frames.size());
  // A frame that is much better connected should not wait for the others' failures, nor they
  // be tried before it has extended the model.
  while (count > 1 && 2 * visibility_[frames[count - 1]] < visibility_[frames[0]])
    --count;
  frames.resize(count);
  return frames;
}

/** Bundle ICP for frames that are independent of each other. */
std::vector<FrameRegistration>
IncrementalMapper::Impl::registerFrames(const SparseModel& model,
                                        const std::vector<std::size_t>& frames, int component) const
{
  std::vector<FrameRegistration> slots(frames.size());
  const int inner = frames.size() == 1 ? options_.num_threads : 1;
  parallelFor(frames.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] = registrar_.bundleICP(model, registrar_.newFrame(model, frames[k], component, inner));
  });
  return slots;
}

/** Adds a frame with its points and updates V. */
void
IncrementalMapper::Impl::addToModel(SparseModel& model, std::size_t frame,
                                    const FrameRegistration& registration, int component)
{
  registrations_[frame] = registration;
  failed_[frame] = !registration.registered;
  if (failed_[frame])
    return;
  if (graph_.isKey(frame))
    model.registerFrame(graph_, frame, registration.world_from_camera, component, options_.tracks);
  else {
    model.registerFrame(frame, registration.world_from_camera, component);
    covariances_[frame] = registration.covariance;
  }
  model.setDepthError(frame, registration.depth_error);
  updateVisibility(model, frame, component);
}

/** Adjusts the frames around the new frames, and all frames each time that the model has grown by
 *  MappingSchedule::adjustment_growth. */
void
IncrementalMapper::Impl::adjust(SparseModel& model, const std::vector<std::size_t>& added,
                                int component, double& next_adjustment)
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
  const double size = double(model.registeredFrames(component).size());
  if (size < next_adjustment)
    return;
  adjuster_.adjustInBetween(model, component);
  updateVisibilities(model, component);
  next_adjustment = size * options_.schedule.adjustment_growth;
}

/** The loop of section 2.2: adds frames until no frame can be added. */
bool
IncrementalMapper::Impl::grow(SparseModel& model, int component, bool keys_only)
{
  failed_.assign(graph_.size(), 0);
  double next_adjustment = FIRST_ADJUSTMENT;
  std::size_t size_at_failure = model.registeredFrames(component).size();
  while (true) {
    // The next frames, by visibility V
    const std::vector<std::size_t> next = nextFrames(model, keys_only);
    if (next.empty()) {
      // Put back and tried again, once the model has grown
      const std::size_t size = model.registeredFrames(component).size();
      if (size == size_at_failure)
        return true;
      size_at_failure = size;
      failed_.assign(graph_.size(), 0);
      continue;
    }
    const std::vector<FrameRegistration> registered = registerFrames(model, next, component);
    for (std::size_t k = 0; k < next.size(); ++k)
      addToModel(model, next[k], registered[k], component);
    adjust(model, next, component, next_adjustment);
    if (!report(model))
      return false;
  }
}

/** Until no false connection is left among them. */
bool
IncrementalMapper::Impl::growKeyFrames(SparseModel& model, int component)
{
  for (int round = 0; round < MAX_CORRECTIONS; ++round) {
    if (!grow(model, component, true))
      return false;
    if (correctFalseConnections(graph_, component, options_.tracks, options_.num_threads, model) ==
        0)
      break;
    // What was registered from a wrong place is adjusted to the right one, and frames that found no
    // place between the two may find it now.
    adjuster_.adjustInBetween(model, component);
    updateVisibilities(model, component);
  }
  return true;
}

/** An adjustment may have changed the tracks of all frames. */
void
IncrementalMapper::Impl::updateVisibilities(const SparseModel& model, int component)
{
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i))
      visibility_[i] = model.visibility(graph_, i, component);
}

} // namespace bundle_icp
