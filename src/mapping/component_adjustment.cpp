// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/component_adjustment.h"

#include "common/by_time.h"
#include "common/free_memory.h"
#include "common/parallel.h"
#include "mapping/frame_motions.h"
#include "mapping/guided_matching.h"
#include "mapping/joint_evidence.h"
#include "refinement/still_camera.h"
#include "refinement/trajectory_smoothing.h"

#include <algorithm>
#include <map>

namespace bundle_icp {
namespace {

/** Rounds of adjustment and outlier removal that end a component. */
constexpr int FINAL_ROUNDS = 2;
/** Minimum number of frames that show how smoothly the camera moves. */
constexpr std::size_t MIN_FOR_MOTION_PRIOR = 20;
/** Share of a frame's depth that another one sees as well, for a dense term without matches. */
constexpr double LEAST_SHARED_DEPTH = 0.3;

} // namespace

AdjusterState
ComponentAdjuster::state() const
{
  AdjusterState state = state_;
  state.prior_trust = prior_.trust();
  return state;
}

void
ComponentAdjuster::setState(const AdjusterState& state)
{
  state_ = state;
  prior_.setTrust(state.prior_trust);
  tellRegistrar();
}

/** Key frames that share most matches with a frame. Where they are few, as on white walls, also
 *  those that share most depth. */
std::vector<std::size_t>
ComponentAdjuster::denseNeighbours(const SparseModel& model, std::size_t frame,
                                   const std::vector<std::size_t>& frames) const
{
  std::vector<std::size_t> chosen;
  const auto choose = [&](const std::vector<Neighbour>& neighbours) {
    for (const Neighbour& neighbour : neighbours)
      if (chosen.size() < state_.num_dense_neighbours && graph_.isKey(neighbour.frame) &&
          neighbour.frame != frame &&
          std::find(chosen.begin(), chosen.end(), neighbour.frame) == chosen.end())
        chosen.push_back(neighbour.frame);
  };
  choose(registrar_.registeredNeighbours(model, frame, model.component(frame)));
  if (chosen.size() < state_.num_dense_neighbours)
    choose(framesSharingDepth(model, registrar_.depthViews(), frame, model.worldFromDepth(frame),
                              frames, LEAST_SHARED_DEPTH));
  return chosen;
}

std::vector<RelativePoseTerm>
ComponentAdjuster::denseTerms(const SparseModel& model,
                              const std::vector<std::size_t>& frames) const
{
  std::vector<std::vector<std::size_t>> neighbours(frames.size());
  parallelFor(frames.size(), options_.num_threads, {},
              [&](std::size_t k) { neighbours[k] = denseNeighbours(model, frames[k], frames); });
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t k = 0; k < frames.size(); ++k)
    for (const std::size_t other : neighbours[k])
      pairs.emplace_back(std::minmax(frames[k], other));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<std::optional<RelativePoseTerm>> slots(pairs.size());
  parallelFor(pairs.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] = registrar_.registerPair(model, pairs[k].first, pairs[k].second);
  });
  std::vector<RelativePoseTerm> terms;
  for (const auto& slot : slots)
    if (slot)
      terms.push_back(*slot);
  return terms;
}

/** Motions from the poses of all frames. Frames that are not registered yet get their visual poses:
 *  key frames alone are too far apart in time. */
void
ComponentAdjuster::findMotions(SparseModel& model, int component) const
{
  if (!options_.schedule.ordered_in_time)
    return; // neighbours in time may be anywhere
  SparseModel placed = model;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < graph_.size(); ++i)
    if (!model.isRegistered(i) && model.visibility(graph_, i, component) > 0 &&
        graph_.exclusion(i).empty())
      others.push_back(i);
  std::vector<FrameRegistration> slots(others.size());
  parallelFor(others.size(), options_.num_threads, {}, [&](std::size_t k) {
    slots[k] =
        registrar_.registerVisually(model, registrar_.newFrame(model, others[k], component, 1));
  });
  for (std::size_t k = 0; k < others.size(); ++k)
    if (slots[k].registered)
      placed.registerFrame(others[k], slots[k].world_from_camera, component);
  estimateMotions(graph_, component, placed);
  for (const std::size_t frame : placed.registeredFrames(component))
    model.setMotion(frame, placed.motion(frame));
}

/** Self-calibration, in the first component that is large enough for it. */
void
ComponentAdjuster::calibrate(SparseModel& model, int component)
{
  const std::vector<std::size_t> keys = keyFrames(model, component);
  const bool moving = model.calibration()[CalibrationParameter::READOUT] != 0 ||
                      model.calibration()[CalibrationParameter::TIME_OFFSET] != 0;
  const bool tests = options_.refinement.self_calibration && state_.calibrated_component < 0 &&
                     keys.size() >= options_.refinement.calibration_test.min_frames;
  if (!moving && !tests)
    return;
  adjustInBetween(model, component);
  findMotions(model, component);
  if (!tests || findStillCamera(graph_, model, component))
    return;
  SelfCalibrationOptions test = options_.refinement.calibration_test;
  test.num_threads = options_.num_threads;
  state_.self_calibration = selfCalibrate(graph_, keys, options_.adjustment, test, model);
  if (options_.refinement.calibration_test.depth_errors && !state_.self_calibration.depth_errors &&
      options_.refinement.num_dense_neighbours > 0)
    state_.num_dense_neighbours = options_.refinement.num_exact_dense_neighbours;
  state_.calibrated_component = component;
  tellRegistrar();
}

/** The result of self-calibration about depth errors. */
void
ComponentAdjuster::tellRegistrar()
{
  if (state_.calibrated_component >= 0 && options_.refinement.calibration_test.depth_errors)
    registrar_.setDepthErrors(state_.self_calibration.depth_errors);
}

std::vector<std::size_t>
ComponentAdjuster::keyFrames(const SparseModel& model, int component) const
{
  std::vector<std::size_t> keys;
  for (const std::size_t frame : model.registeredFrames(component))
    if (graph_.isKey(frame))
      keys.push_back(frame);
  return keys;
}

/** The adjustment of all key frames, without dense terms. */
BundleAdjustmentProblem
ComponentAdjuster::problem(const SparseModel& model, int component) const
{
  BundleAdjustmentProblem problem;
  problem.variable = keyFrames(model, component);
  problem.depth_errors = state_.self_calibration.depth_errors;
  if (component == state_.calibrated_component)
    problem.calibrated = state_.self_calibration.calibrated;
  return problem;
}

void
ComponentAdjuster::adjustInBetween(SparseModel& model, int component)
{
  adjust(model, component, INTERMEDIATE_ITERATIONS, false);
}

void
ComponentAdjuster::adjustFinally(SparseModel& model, int component)
{
  adjust(model, component, options_.adjustment.max_iterations, true);
}

/** Evidence besides the tracks. Before the final adjustment the prior is compared anew: the round
 *  before it went without the prior. In between its deviations only grow, as the model may owe its
 *  agreement to the prior. */
std::vector<RelativePoseTerm>
ComponentAdjuster::relativePoses(const SparseModel& model, int component,
                                 const std::vector<std::size_t>& frames, bool dense)
{
  std::vector<RelativePoseTerm> terms;
  if (dense && state_.num_dense_neighbours > 0)
    terms = denseTerms(model, frames);
  if (dense || component != state_.measured_component)
    prior_.forget();
  state_.measured_component = component;
  prior_.measure(model, frames);
  const std::vector<RelativePoseTerm> of_prior = prior_.terms(model, frames);
  terms.insert(terms.end(), of_prior.begin(), of_prior.end());
  return terms;
}

/** Global bundle adjustment over the key frames of a component; `dense` makes it the final
 *  one, with all evidence and outliers removed in between. */
void
ComponentAdjuster::adjust(SparseModel& model, int component, int max_iterations, bool dense)
{
  BundleAdjustmentProblem problem = this->problem(model, component);
  BundleAdjustmentOptions options = options_.adjustment;
  const int rounds = !options_.schedule.global_adjustment ? 0 : dense ? FINAL_ROUNDS : 1;
  state_.terms.clear();
  for (int round = 0; round < rounds; ++round) {
    // Another round with the dense terms follows: this one need not settle.
    const bool is_last = round + 1 == rounds;
    options.max_iterations =
        is_last ? max_iterations : std::min(max_iterations, INTERMEDIATE_ITERATIONS);
    if (is_last)
      state_.terms = relativePoses(model, component, problem.variable, dense);
    problem.relative_poses = state_.terms;
    adjustBundle(graph_, problem, options, model);
    returnMemory();
    model.removeOutliers(graph_, options_.tracks);
    if (dense)
      for (const std::size_t frame : problem.variable)
        model.extendTracks(graph_, frame, options_.tracks);
    if (dense && !is_last)
      matchByPrediction(graph_, problem.variable, options_.tracks, options_.num_threads, model);
  }
}

/** The frames of a component in the order of time, and how well each is known by itself. */
std::vector<FinalPose>
ComponentAdjuster::finalPoses(const SparseModel& model, int component,
                              const std::vector<std::optional<Matrix6d>>& own) const
{
  std::vector<FinalPose> poses;
  for (const std::size_t frame : byTime(graph_, model.registeredFrames(component)))
    poses.push_back({frame, !own[frame]});
  parallelFor(poses.size(), options_.num_threads, {}, [&](std::size_t k) {
    const std::size_t frame = poses[k].frame;
    poses[k].own = own[frame] ? *own[frame] : registrar_.poseCovariance(model, frame, state_.terms);
  });
  return poses;
}

/** Each frame was registered on its own, and the errors of neighbours in time are independent;
 *  the motion between them is not. */
FinalCovariances
ComponentAdjuster::applyMotionPrior(SparseModel& model, int component,
                                    const std::vector<std::optional<Matrix6d>>& own) const
{
  std::vector<FinalPose> finals = finalPoses(model, component, own);
  BundleAdjustmentProblem evidence = problem(model, component);
  evidence.relative_poses = state_.terms;
  const SparseModel adjusted = model;
  if (options_.refinement.motion_prior && options_.schedule.ordered_in_time &&
      finals.size() >= MIN_FOR_MOTION_PRIOR) {
    std::vector<PoseMeasurement> measurements(finals.size());
    for (std::size_t k = 0; k < finals.size(); ++k) {
      measurements[k].time = graph_.timestamp(finals[k].frame);
      measurements[k].world_from_camera = model.worldFromCamera(finals[k].frame);
      measurements[k].covariance = finals[k].own;
    }
    const std::vector<PoseEstimate> poses =
        smoothTrajectory(measurements, estimateMotionPrior(measurements));
    for (std::size_t k = 0; k < finals.size(); ++k) {
      model.setWorldFromCamera(finals[k].frame, poses[k].world_from_camera);
      finals[k].change = poses[k].covariance - finals[k].own;
    }
  }
  return finalCovariances(graph_, adjusted, evidence, options_.adjustment, finals);
}

void
numberBySize(SparseModel& model)
{
  std::map<int, std::vector<std::size_t>> frames_of; // without those that have lost all frames
  for (const std::size_t frame : model.registeredFrames())
    frames_of[model.component(frame)].push_back(frame);
  std::vector<std::vector<std::size_t>> components;
  for (auto& [component, frames] : frames_of)
    components.push_back(std::move(frames));
  std::stable_sort(components.begin(), components.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (std::size_t c = 0; c < components.size(); ++c)
    for (const std::size_t frame : components[c])
      model.registerFrame(frame, model.worldFromCamera(frame), int(c));
}

} // namespace bundle_icp
