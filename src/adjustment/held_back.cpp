// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "adjustment/held_back.h"

#include "adjustment/residuals.h"

#include <bundle_icp/common/exceptions.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace bundle_icp {

std::vector<Observation>
observationsThatTakePart(const BundleAdjustmentProblem& problem,
                         const std::set<std::size_t>& frames, const ScenePoint& point)
{
  std::vector<Observation> observations;
  for (std::size_t k = 0; k < point.track.size(); ++k)
    if (frames.count(point.track[k].frame) && !(problem.hold_back && isHeldBack(point, k)))
      observations.push_back(point.track[k]);
  if (observations.size() < std::max<std::size_t>(problem.min_track_length, 2))
    observations.clear();
  return observations;
}

bool
isHeldBack(const ScenePoint& point, std::size_t index_in_track)
{
  if (point.track.size() < 4)
    return false;
  // The features' numbers spread the choice over points and frames.
  return (std::size_t(point.track.front().feature) + index_in_track) % 5 == 0;
}

std::vector<double>
heldBackCost(const ImageGraph& graph, const BundleAdjustmentProblem& problem,
             const BundleAdjustmentOptions& options, const SparseModel& model)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException("heldBackCost: " + error);
  std::set<std::size_t> frames(problem.variable.begin(), problem.variable.end());
  frames.insert(problem.constant.begin(), problem.constant.end());
  std::map<std::size_t, double> cost_of_frame;
  for (const std::size_t frame : problem.variable)
    cost_of_frame[frame] = 0;
  for (const ScenePoint& point : model.points()) {
    if (observationsThatTakePart(problem, frames, point).empty())
      continue;
    for (std::size_t k = 0; k < point.track.size(); ++k) {
      const Observation& o = point.track[k];
      const auto cost = cost_of_frame.find(o.frame);
      if (cost == cost_of_frame.end() || !isHeldBack(point, k))
        continue;
      const Features& features = graph.features(o.frame);
      const PoseBlock pose(model.worldFromCamera(o.frame));
      const FrameMeasurement measurement{graph.camera(), model.motion(o.frame)};
      const double* parameters[] = {pose.values, point.position.data(),
                                    model.calibration().values.data(),
                                    model.depthError(o.frame).data()};
      const ObservationResiduals residuals(measurement, features, o.feature,
                                           options.use_depth ? &graph.camera().depth_noise
                                                             : nullptr);
      cost->second += residuals.cost(parameters, options.loss_scale);
    }
  }
  std::vector<double> costs;
  for (const std::size_t frame : problem.variable)
    costs.push_back(cost_of_frame[frame]);
  return costs;
}

} // namespace bundle_icp
