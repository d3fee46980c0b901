// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/refinement/self_calibration.h>

#include "adjustment/held_back.h"
#include "common/by_time.h"
#include "common/parallel.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace bundle_icp {
namespace {

using P = CalibrationParameter;

/** Held-back observations have a hold on poses and points that were fitted to them, too: what is
 *  left of it must be far less than the gains that are compared. */
constexpr double FUNCTION_TOLERANCE = 1e-7;
/** A correction of fewer standard deviations is none. */
constexpr double MIN_DEVIATIONS = 2;
/** Of the corrections of both focal lengths: pixels are as square as the nominal camera's. */
constexpr double MAX_DIFFERENCE = 0.02;
/** Parts of the frames of which each is left out once. */
constexpr std::size_t NUM_PARTS = 4;

std::vector<CalibrationTest>
candidates(const SelfCalibrationOptions& options)
{
  std::vector<CalibrationTest> tests;
  if (options.depth_errors)
    tests.push_back({"depth error of each image", {}, false, 0, 0, {}});
  if (options.camera)
    for (const auto& [name, parameters] : std::vector<std::pair<const char*, std::vector<P>>>{
             {"rolling shutter", {P::READOUT}},
             {"time offset of depth", {P::TIME_OFFSET}},
             {"focal length", {P::FOCAL_X, P::FOCAL_Y}},
             {"principal point", {P::CENTER_X, P::CENTER_Y}},
             {"radial distortion", {P::RADIAL_1, P::RADIAL_2}},
             {"depth bias", {P::DEPTH_BIAS}},
             {"depth tilt", {P::DEPTH_TILT_X, P::DEPTH_TILT_Y}},
             {"depth to colour alignment", {P::DEPTH_SHIFT_X, P::DEPTH_SHIFT_Y}}})
      tests.push_back({name, parameters, false, 0, 0, {}});
  return tests;
}

/** Grows a set from the frame with most observations by frames that share most points with it. */
std::vector<std::size_t>
wellConnected(const SparseModel& model, const std::vector<std::size_t>& frames, std::size_t count)
{
  const std::set<std::size_t> allowed(frames.begin(), frames.end());
  std::vector<std::size_t> shared(model.numFrames(), 0);
  std::vector<std::vector<std::size_t>> points_of(model.numFrames());
  for (std::size_t p = 0; p < model.points().size(); ++p)
    for (const Observation& o : model.points()[p].track)
      if (allowed.count(o.frame))
        points_of[o.frame].push_back(p);
  std::vector<char> taken(model.numFrames(), 0), seen(model.points().size(), 0);
  std::vector<std::size_t> chosen;
  const auto better = [&](std::size_t a, std::size_t b) {
    return std::make_pair(shared[a], points_of[a].size()) >
           std::make_pair(shared[b], points_of[b].size());
  };
  while (chosen.size() < std::min(count, frames.size())) {
    std::size_t best = model.numFrames();
    for (const std::size_t frame : frames)
      if (!taken[frame] && (best == model.numFrames() || better(frame, best)))
        best = frame;
    taken[best] = 1;
    chosen.push_back(best);
    for (const std::size_t p : points_of[best]) {
      if (seen[p])
        continue;
      seen[p] = 1;
      for (const Observation& o : model.points()[p].track)
        ++shared[o.frame];
    }
  }
  return chosen;
}

/** A correction, tested on top of the corrections applied so far. */
struct Trial {
  SparseModel model;
  double gain = 0;
  double significance = 0;
};

class SelfCalibration {
public:
  SelfCalibration(const ImageGraph& graph, const std::vector<std::size_t>& frames,
                  const BundleAdjustmentOptions& adjustment, const SelfCalibrationOptions& options)
  : graph_(graph), adjustment_(adjustment), options_(options)
  {
    problem_.variable = frames;
    problem_.hold_back = true;
    problem_.min_track_length = options.min_track_length;
    adjustment_.max_iterations = options.max_iterations;
    adjustment_.function_tolerance = std::min(adjustment_.function_tolerance, FUNCTION_TOLERANCE);
  }

  SelfCalibrationResult
  run(SparseModel& model);

private:
  Trial
  tryOut(const SparseModel& model, const CalibrationTest& test) const;
  bool
  isPlausible(const Calibration& calibration, CalibrationTest& test) const;
  void
  addCorrections(SparseModel& model, SelfCalibrationResult& result);
  bool
  dropZeros(SparseModel& model, SelfCalibrationResult& result);
  WantedFocalLength
  wantedFocal(const SparseModel& model) const;
  Eigen::Vector2d
  fittedFocal(const SparseModel& model, const std::vector<std::size_t>& left_out) const;

  static void
  add(const CalibrationTest& test, BundleAdjustmentProblem& problem)
  {
    problem.depth_errors |= test.parameters.empty();
    problem.calibrated.insert(problem.calibrated.end(), test.parameters.begin(),
                              test.parameters.end());
  }

  bool
  passes(const CalibrationTest& test) const
  {
    return test.significance > options_.significance && test.gain > options_.min_gain;
  }

  const ImageGraph& graph_;
  BundleAdjustmentOptions adjustment_;
  const SelfCalibrationOptions& options_;
  BundleAdjustmentProblem problem_; ///< with the corrections applied so far
  std::vector<double> cost_;        ///< of held-back observations, with these
};

Trial
SelfCalibration::tryOut(const SparseModel& model, const CalibrationTest& test) const
{
  Trial trial{model};
  BundleAdjustmentProblem problem = problem_;
  add(test, problem);
  adjustBundle(graph_, problem, adjustment_, trial.model);
  const std::vector<double> cost = heldBackCost(graph_, problem, adjustment_, trial.model);
  // Observations of one frame share its pose and are not independent: frames count as samples.
  double sum = 0, sum2 = 0, total = 0;
  for (std::size_t i = 0; i < cost.size(); ++i) {
    const double gain = cost_[i] - cost[i];
    sum += gain;
    sum2 += gain * gain;
    total += cost_[i];
  }
  const double n = double(cost.size()), mean = sum / n;
  const double variance = std::max(0.0, sum2 / n - mean * mean) / (n - 1);
  trial.gain = total > 0 ? sum / total : 0;
  trial.significance = variance > 0 ? mean / std::sqrt(variance) : 0;
  return trial;
}

/** Whether the values lie within what cameras are; if not, the test keeps them. */
bool
SelfCalibration::isPlausible(const Calibration& calibration, CalibrationTest& test) const
{
  // A camera that turns about one axis shows one focal length alone.
  const bool is_square =
      test.parameters.empty() || test.parameters.front() != P::FOCAL_X ||
      std::abs(calibration[P::FOCAL_X] - calibration[P::FOCAL_Y]) < MAX_DIFFERENCE;
  const bool is_plausible =
      is_square && std::all_of(test.parameters.begin(), test.parameters.end(), [&](P parameter) {
        return std::abs(calibration[parameter]) < largestCorrection(parameter, graph_.camera());
      });
  for (const P parameter : test.parameters)
    if (!is_plausible)
      test.implausible.push_back(calibration[parameter]);
  return is_plausible;
}

/** One after the other, the best first, as long as there are good ones. */
void
SelfCalibration::addCorrections(SparseModel& model, SelfCalibrationResult& result)
{
  while (true) {
    std::vector<std::size_t> open;
    for (std::size_t t = 0; t < result.tests.size(); ++t)
      if (!result.tests[t].applied)
        open.push_back(t);
    std::vector<Trial> trials(open.size());
    parallelFor(open.size(), options_.num_threads, {},
                [&](std::size_t k) { trials[k] = tryOut(model, result.tests[open[k]]); });
    std::size_t best = open.size();
    for (std::size_t k = 0; k < open.size(); ++k) {
      CalibrationTest& test = result.tests[open[k]];
      test.gain = trials[k].gain;
      test.significance = trials[k].significance;
      if (passes(test) && (best == open.size() || trials[k].gain > trials[best].gain))
        best = k;
    }
    if (best == open.size())
      return;
    CalibrationTest& test = result.tests[open[best]];
    if (!isPlausible(trials[best].model.calibration(), test))
      return; // what is fitted to a wrong camera explains nothing
    test.applied = true;
    add(test, problem_);
    model = std::move(trials[best].model);
    cost_ = heldBackCost(graph_, problem_, adjustment_, model);
  }
}

/** Takes back corrections that are 0 within their deviations. \return whether there was one */
bool
SelfCalibration::dropZeros(SparseModel& model, SelfCalibrationResult& result)
{
  Calibration calibration = model.calibration();
  problem_.calibrated.clear();
  bool has_dropped = false;
  for (CalibrationTest& test : result.tests) {
    if (!test.applied || test.parameters.empty())
      continue;
    test.applied = std::any_of(test.parameters.begin(), test.parameters.end(), [&](P parameter) {
      return std::abs(calibration[parameter]) >
             MIN_DEVIATIONS * calibration.deviations[int(parameter)];
    });
    if (test.applied)
      add(test, problem_);
    has_dropped |= !test.applied;
    for (const P parameter : test.parameters)
      if (!test.applied)
        calibration[parameter] = calibration.deviations[int(parameter)] = 0;
  }
  model.setCalibration(calibration);
  return has_dropped;
}

/** FOCAL_X and FOCAL_Y fitted with axis and distortion, by all frames but some. */
Eigen::Vector2d
SelfCalibration::fittedFocal(const SparseModel& model,
                             const std::vector<std::size_t>& left_out) const
{
  BundleAdjustmentProblem problem = problem_;
  for (const P parameter :
       {P::FOCAL_X, P::FOCAL_Y, P::CENTER_X, P::CENTER_Y, P::RADIAL_1, P::RADIAL_2})
    if (std::find(problem.calibrated.begin(), problem.calibrated.end(), parameter) ==
        problem.calibrated.end())
      problem.calibrated.push_back(parameter);
  problem.variable.erase(std::remove_if(problem.variable.begin(), problem.variable.end(),
                                        [&](std::size_t frame) {
                                          return std::count(left_out.begin(), left_out.end(),
                                                            frame) > 0;
                                        }),
                         problem.variable.end());
  SparseModel fitted = model;
  adjustBundle(graph_, problem, adjustment_, fitted);
  return {fitted.calibration()[P::FOCAL_X], fitted.calibration()[P::FOCAL_Y]};
}

/** The jackknife over runs of frames: errors of neighbours in time are alike. */
WantedFocalLength
SelfCalibration::wantedFocal(const SparseModel& model) const
{
  const std::vector<std::size_t> frames = byTime(graph_, problem_.variable);
  std::vector<std::vector<std::size_t>> left_out(1); // first none
  for (std::size_t k = 0; k < NUM_PARTS; ++k)
    left_out.emplace_back(frames.begin() + std::ptrdiff_t(k * frames.size() / NUM_PARTS),
                          frames.begin() + std::ptrdiff_t((k + 1) * frames.size() / NUM_PARTS));
  std::vector<Eigen::Vector2d> fits(left_out.size());
  parallelFor(fits.size(), options_.num_threads, {},
              [&](std::size_t k) { fits[k] = fittedFocal(model, left_out[k]); });
  double sum = 0, sum2 = 0;
  for (std::size_t k = 1; k < fits.size(); ++k) {
    sum += fits[k].mean();
    sum2 += fits[k].mean() * fits[k].mean();
  }
  const double n = NUM_PARTS;
  const double variance = (n - 1) / n * std::max(0.0, sum2 - sum * sum / n);
  return {fits[0].x(), fits[0].y(), std::sqrt(variance)};
}

SelfCalibrationResult
SelfCalibration::run(SparseModel& model)
{
  SelfCalibrationResult result;
  result.tests = candidates(options_);
  adjustBundle(graph_, problem_, adjustment_, model);
  cost_ = heldBackCost(graph_, problem_, adjustment_, model);
  addCorrections(model, result);
  if (options_.camera)
    result.wanted_focal = wantedFocal(model);
  const auto setDeviations = [&] {
    Calibration calibration = model.calibration();
    calibration.deviations = calibrationDeviations(graph_, problem_, adjustment_, model);
    model.setCalibration(calibration);
  };
  setDeviations();
  if (dropZeros(model, result)) {
    adjustBundle(graph_, problem_, adjustment_, model);
    setDeviations();
  }
  result.calibrated = problem_.calibrated;
  result.depth_errors = problem_.depth_errors;
  return result;
}

} // namespace

double
largestCorrection(CalibrationParameter parameter, const CameraIntrinsics& camera)
{
  switch (parameter) {
  case P::FOCAL_X:
  case P::FOCAL_Y:
    return 0.05;
  case P::CENTER_X:
  case P::DEPTH_SHIFT_X:
    return 0.1 * camera.width;
  case P::CENTER_Y:
  case P::DEPTH_SHIFT_Y:
    return 0.1 * camera.height;
  case P::RADIAL_1:
  case P::RADIAL_2:
    return 2;
  case P::DEPTH_BIAS:
  case P::DEPTH_TILT_X:
  case P::DEPTH_TILT_Y:
    return 0.1;
  case P::READOUT:
    return 0.1;
  case P::TIME_OFFSET:
    return 0.25;
  }
  return 0;
}

bool
SelfCalibrationOptions::isValid(std::string* error) const
{
  const char* reason = max_frames < 2 || min_frames < 2 ? "max_frames and min_frames must be >= 2"
                       : min_track_length < 2           ? "min_track_length must be >= 2"
                       : !(significance > 0)            ? "significance must be > 0"
                       : !(min_gain >= 0)               ? "min_gain must be >= 0"
                       : max_iterations < 1             ? "max_iterations must be >= 1"
                       : num_threads < 0                ? "num_threads must be >= 0"
                                                        : nullptr;
  if (reason && error)
    *error = reason;
  return !reason;
}

SelfCalibrationResult
selfCalibrate(const ImageGraph& graph, const std::vector<std::size_t>& frames,
              const BundleAdjustmentOptions& adjustment, const SelfCalibrationOptions& options,
              SparseModel& model)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("selfCalibrate: " + error);
  SelfCalibrationResult untested;
  untested.tests = candidates(options);
  if (untested.tests.empty() || frames.size() < options.min_frames)
    return untested;
  return SelfCalibration(graph, wellConnected(model, frames, options.max_frames), adjustment,
                         options)
      .run(model);
}

} // namespace bundle_icp
