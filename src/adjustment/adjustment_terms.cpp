// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/adjustment_terms.h"

#include "adjustment/held_back.h"
#include "common/parallel.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace bundle_icp {
namespace {

/** Parameter blocks of an observation's residuals: pose, point, calibration, depth error. */
std::array<const double*, 4>
parameterBlocks(const AdjustedObservation& o, const AdjustmentState& state)
{
  return {state.poses[std::size_t(o.frame)].values, state.points[std::size_t(o.point)].data(),
          state.calibration.data(), state.depth_errors[std::size_t(o.frame)].data()};
}

} // namespace

AdjustmentTerms::AdjustmentTerms(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
                                 const BundleAdjustmentOptions& options, const SparseModel& model)
: graph_(graph), options_(options)
{
  addFrames(problem, model);
  addObservations(problem, model);
  std::map<std::size_t, int> index;
  for (std::size_t i = 0; i < frames.size(); ++i)
    index[frames[i].frame] = int(i);
  for (const RelativePoseTerm& term : problem.relative_poses) {
    const auto first = index.find(term.first), second = index.find(term.second);
    if (first != index.end() && second != index.end() && term.first != term.second)
      pairs.push_back(
          {first->second, second->second,
           std::make_unique<RelativePoseResidual>(term.first_from_second, term.information)});
  }
  for (const CalibrationParameter parameter : problem.calibrated)
    calibrated.push_back(int(parameter));
  std::sort(calibrated.begin(), calibrated.end());
  calibrated.erase(std::unique(calibrated.begin(), calibrated.end()), calibrated.end());
}

void
AdjustmentTerms::addFrames(const BundleAdjustmentProblem& problem, const SparseModel& model)
{
  const std::set<std::size_t> held(problem.constant.begin(), problem.constant.end());
  std::set<std::size_t> known;
  const auto add = [&](std::size_t frame, bool pose_moves, bool depth_error_moves) {
    if (frame >= model.numFrames() || !model.isRegistered(frame))
      throw BadArgumentException("adjustBundle: frame " + std::to_string(frame) +
                                 " is not registered");
    if (known.insert(frame).second)
      frames.push_back(
          {frame, pose_moves, depth_error_moves, {graph_.camera(), model.motion(frame)}});
  };
  for (std::size_t k = 0; k < problem.variable.size(); ++k) {
    // The frame that is held to fix the gauge has a depth error like any other.
    const bool fixes_gauge =
        problem.constant.empty() && problem.variable[k] == problem.variable.front();
    if (!held.count(problem.variable[k]) && (!fixes_gauge || problem.depth_errors))
      add(problem.variable[k], !fixes_gauge, problem.depth_errors);
  }
  num_moving = frames.size();
  for (const std::vector<std::size_t>* rest : {&problem.variable, &problem.constant})
    for (const std::size_t frame : *rest)
      add(frame, false, false);
}

void
AdjustmentTerms::addObservations(const BundleAdjustmentProblem& problem, const SparseModel& model)
{
  std::set<std::size_t> taking_part;
  std::vector<int> index(model.numFrames(), -1);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    taking_part.insert(frames[i].frame);
    index[frames[i].frame] = int(i);
  }
  for (std::size_t p = 0; p < model.points().size(); ++p) {
    const std::vector<Observation> track =
        observationsThatTakePart(problem, taking_part, model.points()[p]);
    if (std::none_of(track.begin(), track.end(), [&](const Observation& o) {
          return frames[std::size_t(index[o.frame])].pose_moves;
        }))
      continue;
    first_observation.push_back(observations.size());
    for (const Observation& o : track)
      observations.push_back(
          {index[o.frame],
           int(points.size()),
           {frames[std::size_t(index[o.frame])].measurement, graph_.features(o.frame), o.feature,
            options_.use_depth ? &graph_.camera().depth_noise : nullptr}});
    points.push_back(p);
  }
  first_observation.push_back(observations.size());
}

AdjustmentState
AdjustmentTerms::initialState(const SparseModel& model) const
{
  AdjustmentState state;
  for (const AdjustedFrame& frame : frames) {
    state.poses.emplace_back(model.worldFromCamera(frame.frame));
    state.depth_errors.push_back(model.depthError(frame.frame));
  }
  for (const std::size_t point : points)
    state.points.push_back(model.points()[point].position);
  state.calibration = model.calibration().values;
  return state;
}

void
AdjustmentTerms::writeBack(const AdjustmentState& state, SparseModel& model) const
{
  for (std::size_t i = 0; i < num_moving; ++i) {
    if (frames[i].pose_moves)
      model.setWorldFromCamera(frames[i].frame, state.poses[i].worldFromCamera());
    model.setDepthError(frames[i].frame, state.depth_errors[i]);
  }
  for (std::size_t p = 0; p < points.size(); ++p)
    model.setPosition(points[p], state.points[p]);
  Calibration calibration = model.calibration();
  calibration.values = state.calibration;
  model.setCalibration(calibration);
}

double
AdjustmentTerms::cost(const AdjustmentState& state, int num_threads) const
{
  std::vector<double> slots(numChunks(), 0.0);
  parallelFor(slots.size(), num_threads, {}, [&](std::size_t chunk) {
    const auto [first, end] = pointsOf(chunk);
    for (std::size_t k = first_observation[first]; k < first_observation[end]; ++k) {
      const AdjustedObservation& o = observations[k];
      slots[chunk] += o.residuals.cost(parameterBlocks(o, state).data(), options_.loss_scale);
    }
  });
  double sum = 0;
  for (const double slot : slots)
    sum += slot;
  for (const AdjustedPair& pair : pairs) {
    const double* parameters[] = {state.poses[std::size_t(pair.first)].values,
                                  state.poses[std::size_t(pair.second)].values};
    Vector6d residual;
    pair.residual->linearise(parameters, residual.data(), nullptr);
    sum += residual.squaredNorm();
  }
  for (std::size_t i = 0; i < num_moving; ++i)
    if (frames[i].depth_error_moves)
      sum += (state.depth_errors[i] / options_.depth_error_deviation).squaredNorm();
  if (!calibrated.empty())
    sum += state.calibration.cwiseQuotient(calibrationPrior()).squaredNorm();
  return sum / 2;
}

ObservationRows
AdjustmentTerms::linearise(const AdjustedObservation& o, const AdjustmentState& state) const
{
  ObservationRows rows = o.residuals.linearise(parameterBlocks(o, state).data(),
                                               options_.loss_scale, !calibrated.empty());
  const AdjustedFrame& frame = frames[std::size_t(o.frame)];
  if (!frame.pose_moves)
    rows.by_frame.leftCols<6>().setZero();
  if (!frame.depth_error_moves)
    rows.by_frame.rightCols<3>().setZero();
  return rows;
}

std::size_t
AdjustmentTerms::numResiduals() const
{
  std::size_t count = 2 * observations.size() + 6 * pairs.size();
  for (const AdjustedObservation& o : observations)
    count += o.residuals.depth ? 1 : 0;
  for (const AdjustedFrame& frame : frames)
    count += frame.depth_error_moves ? 3 : 0;
  return count + (calibrated.empty() ? 0 : NUM_CALIBRATION_PARAMETERS);
}

} // namespace bundle_icp
