// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/mapping/incremental_mapper.h>

#include "mapping/component_growth.h"
#include "mapping/component_joints.h"
#include "mapping/registration_by_time.h"

#include <bundle_icp/common/exceptions.h>

#include <chrono>
#include <utility>

namespace bundle_icp {
namespace {

/** No more work than this is lost with the process, but for a step that takes longer. */
constexpr std::chrono::seconds BETWEEN_SAVES{3};

} // namespace

class IncrementalMapper::Impl {
public:
  Impl(const ImageGraph& graph, DepthViewProvider depth_views, const MapperOptions& options)
  : graph_(graph), depth_views_(std::move(depth_views)), options_(withThreads(options)),
    registrar_(graph_, depth_views_, options_.registration, options_.adjustment),
    adjuster_(graph_, registrar_, options_),
    growth_(graph_, registrar_, adjuster_, options_, state_),
    joiner_(graph_, depth_views_, registrar_, options_)
  {
    state_.registrations.resize(graph.size());
    state_.visibility.resize(graph.size());
    state_.covariances.resize(graph.size());
  }

  bool
  run(SparseModel& model, const ProgressCallback& progress, MapStore* store);

  const SelfCalibrationResult&
  selfCalibration() const
  {
    return adjuster_.selfCalibration();
  }

  const MapperState&
  state() const
  {
    return state_;
  }

private:
  static MapperOptions
  withThreads(MapperOptions options)
  {
    options.adjustment.num_threads = options.num_threads;
    return options;
  }
  void
  begin(SparseModel& model);
  bool
  runStage(SparseModel& model);
  void
  save(const SparseModel& model);
  bool
  step(const SparseModel& model);
  bool
  joinComponents(SparseModel& model);
  void
  adjustFinally(SparseModel& model);
  void
  registerFramesByTime(SparseModel& model);

  const ImageGraph& graph_;
  const DepthViewProvider depth_views_;
  const MapperOptions options_;
  FrameRegistrar registrar_;
  ComponentAdjuster adjuster_;
  MapperState state_; ///< without that of adjuster_
  ComponentGrowth growth_;
  ComponentJoiner joiner_;
  ProgressCallback progress_;
  MapStore* store_ = nullptr;
  std::chrono::steady_clock::time_point saved_;
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
IncrementalMapper::run(SparseModel& model, const ProgressCallback& progress, MapStore* store)
{
  return impl_->run(model, progress, store);
}

const SelfCalibrationResult&
IncrementalMapper::selfCalibration() const
{
  return impl_->selfCalibration();
}

const PosePriorReport&
IncrementalMapper::posePrior() const
{
  return impl_->state().pose_prior;
}

const std::vector<ComponentJoint>&
IncrementalMapper::joints() const
{
  return impl_->state().joints;
}

const std::vector<FrameRegistration>&
IncrementalMapper::registrations() const
{
  return impl_->state().registrations;
}

bool
IncrementalMapper::Impl::run(SparseModel& model, const ProgressCallback& progress, MapStore* store)
{
  if (std::exchange(was_run_, true))
    throw BadArgumentException("IncrementalMapper: run() was called before; a mapper runs once");
  progress_ = progress;
  store_ = store;
  saved_ = std::chrono::steady_clock::now();
  begin(model);
  bool completed = true;
  while (completed && state_.stage != MapperStage::DONE) {
    completed = runStage(model);
    save(model);
  }
  numberBySize(model);
  return completed;
}

/** From the state of an earlier run, where there is one. */
void
IncrementalMapper::Impl::begin(SparseModel& model)
{
  if (const auto bytes = store_ ? store_->load() : std::nullopt) {
    fromBytes(*bytes, state_, model);
    adjuster_.setState(state_.adjuster);
    return;
  }
  model.resize(graph_.size());
  model.setCalibration(options_.refinement.calibration);
  for (std::size_t i = 0; i < graph_.size(); ++i)
    state_.registrations[i].reason = graph_.exclusion(i);
}

void
IncrementalMapper::Impl::save(const SparseModel& model)
{
  if (!store_)
    return;
  state_.adjuster = adjuster_.state();
  store_->save(toBytes(state_, model));
  saved_ = std::chrono::steady_clock::now();
}

/** Between two batches of frames. */
bool
IncrementalMapper::Impl::step(const SparseModel& model)
{
  if (std::chrono::steady_clock::now() - saved_ > BETWEEN_SAVES)
    save(model);
  return !progress_ || progress_({"registration", model.registeredFrames().size(), graph_.size()});
}

/** The next part of the work on the components, one after the other.
 *  \return false when the run was stopped in it */
bool
IncrementalMapper::Impl::runStage(SparseModel& model)
{
  const auto step = [this, &model] { return this->step(model); };
  switch (state_.stage) {
  case MapperStage::NEXT_COMPONENT:
    state_.stage = growth_.initialise(model) ? MapperStage::KEY_FRAMES : MapperStage::JOINT;
    growth_.begin(model);
    return true;
  case MapperStage::KEY_FRAMES:
    if (!growth_.addKeyFrames(model, step))
      return false;
    adjuster_.calibrate(model, state_.component);
    state_.stage = MapperStage::ADJUSTMENT;
    return true;
  case MapperStage::JOINT:
    state_.stage = joinComponents(model) ? MapperStage::ADJUSTMENT : MapperStage::DONE;
    return true;
  case MapperStage::ADJUSTMENT:
    adjustFinally(model);
    state_.stage = MapperStage::OTHER_FRAMES;
    growth_.begin(model);
    return true;
  case MapperStage::OTHER_FRAMES:
    // Frames that only look like others: registered against the finished model
    if (!growth_.addFrames(model, false, step))
      return false;
    state_.stage = MapperStage::FRAMES_BY_TIME;
    return true;
  case MapperStage::FRAMES_BY_TIME:
    registerFramesByTime(model);
    state_.stage = state_.joints.empty() ? MapperStage::NEXT_COMPONENT : MapperStage::JOINT;
    ++state_.component;
    return true;
  case MapperStage::DONE:
    break;
  }
  return true;
}

/** Joins two parts that share too few features. That makes a component larger, in which frames may
 *  find their place that had none. \return whether two were joined */
bool
IncrementalMapper::Impl::joinComponents(SparseModel& model)
{
  if (!options_.refinement.join_by_geometry ||
      options_.registration.method != FrameRegistrationMethod::BUNDLE_ICP)
    return false;
  const std::optional<MadeJoint> joint = joiner_.joinNext(model);
  if (!joint)
    return false;
  state_.component = joint->component;
  state_.joints.push_back(joint->report);
  for (const std::size_t frame : joint->moved) {
    FrameRegistration& registration = state_.registrations[frame];
    registration.registered = registration.by_geometry = true;
    registration.reason.clear();
    state_.covariances[frame].reset(); // adjusted with the others from now on
  }
  return true;
}

void
IncrementalMapper::Impl::adjustFinally(SparseModel& model)
{
  adjuster_.adjustFinally(model, state_.component);
  growth_.updateVisibilities(model);
  const PosePriorReport& of_prior = adjuster_.prior().trust().report;
  if (state_.component == 0 || of_prior.motions > state_.pose_prior.motions)
    state_.pose_prior = of_prior;
}

/** Then all frames of the component have a pose, and get their most likely ones. */
void
IncrementalMapper::Impl::registerFramesByTime(SparseModel& model)
{
  for (const auto& [frame, registration] :
       registerByTime(graph_, registrar_, options_, adjuster_.prior(), state_.component, model)) {
    state_.registrations[frame] = registration;
    if (registration.registered)
      state_.covariances[frame] = registration.covariance;
  }
  for (const auto& [frame, covariance] :
       adjuster_.applyMotionPrior(model, state_.component, state_.covariances)) {
    FrameRegistration& registration = state_.registrations[frame];
    registration.covariance = covariance;
    registration.rotation_deviation = largestDeviation(covariance.topLeftCorner<3, 3>());
    registration.position_deviation = largestDeviation(covariance.bottomRightCorner<3, 3>());
  }
}

} // namespace bundle_icp
