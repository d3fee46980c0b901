// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/frame_appearance.h"

#include "volume/color_gains.h"

#include <algorithm>

namespace bundle_icp {
namespace {

std::vector<ColorObservation>
trackColors(const ImageGraph& graph, const SparseModel& model)
{
  std::vector<ColorObservation> observations;
  for (std::size_t point = 0; point < model.points().size(); ++point)
    for (const Observation& observation : model.points()[point].track)
      observations.push_back({observation.frame, point,
                              graph.features(observation.frame).colors[observation.feature]});
  return observations;
}

/** The square of the sharpness relative to the median of the neighbours, at most 1: a frame of
 *  half the neighbours' sharpness has a quarter of the weight. */
float
sharpnessWeight(const ImageGraph& graph, std::size_t frame)
{
  std::vector<double> sharpness;
  for (const ImageEdge& edge : graph.edges(frame))
    sharpness.push_back(graph.features(edge.neighbour).sharpness);
  if (sharpness.empty())
    return 1;
  const auto median = sharpness.begin() + std::ptrdiff_t(sharpness.size() / 2);
  std::nth_element(sharpness.begin(), median, sharpness.end());
  if (!(*median > 0))
    return 1;
  const double relative = std::clamp(graph.features(frame).sharpness / *median, 0.1, 1.0);
  return float(relative * relative);
}

} // namespace

std::vector<ColorCorrection>
colorCorrections(const ImageGraph& graph, const SparseModel& model)
{
  const std::vector<Eigen::Vector3f> gains =
      estimateColorGains(trackColors(graph, model), graph.size());
  std::vector<ColorCorrection> corrections(graph.size());
  for (std::size_t frame = 0; frame < graph.size(); ++frame)
    corrections[frame] = {gains[frame], sharpnessWeight(graph, frame)};
  return corrections;
}

} // namespace bundle_icp
