// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/result_frames.h"

#include "mapping/component_adjustment.h"

#include <algorithm>
#include <limits>

namespace bundle_icp {
namespace {

/** Deviations are relative to the first frame of a component: without it nothing is known. */
void
forgetLostDeviations(ReconstructionResult& result)
{
  constexpr double unknown = std::numeric_limits<double>::infinity();
  for (int component = 0; component < int(result.component_sizes.size()); ++component) {
    const auto is_in = [&](const FrameReport& frame) {
      return frame.registered && frame.component == component;
    };
    if (std::any_of(result.frames.begin(), result.frames.end(), [&](const FrameReport& frame) {
          return is_in(frame) && frame.position_deviation == 0;
        }))
      continue;
    for (FrameReport& frame : result.frames)
      if (is_in(frame)) {
        frame.covariance.setZero();
        frame.covariance.diagonal().setConstant(unknown);
        frame.position_deviation = frame.rotation_deviation = unknown;
      }
  }
}

} // namespace

void
chooseWorld(ReconstructionResult& result)
{
  SparseModel& model = result.model;
  const ImageGraph& graph = *result.graph;
  result.component_sizes.clear();
  for (int component = 0;; ++component) {
    const std::vector<std::size_t> nodes = model.registeredFrames(component);
    if (nodes.empty())
      break;
    result.component_sizes.push_back(nodes.size());
    const std::size_t first =
        *std::min_element(nodes.begin(), nodes.end(), [&graph](std::size_t a, std::size_t b) {
          return graph.timestamp(a) < graph.timestamp(b);
        });
    model.transform(component, model.worldFromCamera(first).inverse());
    model.setWorldFromCamera(first, Pose::Identity());
  }
}

void
reportPose(std::size_t node, ReconstructionResult& result)
{
  FrameReport& frame = result.frames[result.frame_of_node[node]];
  frame.registered = result.model.isRegistered(node);
  frame.component = result.model.component(node);
  frame.world_from_camera =
      frame.registered ? result.model.worldFromCamera(node) : Pose::Identity();
  frame.world_from_depth = result.model.worldFromDepth(node);
}

void
leaveOutRefuted(const std::vector<VerifiedFrame>& frames, ReconstructionResult& result)
{
  SparseModel& model = result.model;
  const auto remove = [&](std::size_t node, const std::string& reason) {
    model.removeFrame(node);
    FrameReport& frame = result.frames[result.frame_of_node[node]];
    frame.verdict = FrameVerdict::LEFT_OUT;
    frame.reason = reason;
    frame.doubt.clear();
    frame.covariance.setZero();
    frame.position_deviation = frame.rotation_deviation = 0;
  };
  bool has_refuted = false;
  for (std::size_t node = 0; node < frames.size(); ++node)
    if (frames[node].refuted) {
      has_refuted = true;
      remove(node, frames[node].doubt);
    }
  if (!has_refuted)
    return;
  for (int component = 0; component < int(result.component_sizes.size()); ++component)
    if (const auto left = model.registeredFrames(component); left.size() == 1)
      remove(left.front(), "the frames that shared matches with it are left out");
  numberBySize(model);
  chooseWorld(result);
  for (std::size_t node = 0; node < frames.size(); ++node)
    reportPose(node, result);
  forgetLostDeviations(result);
}

} // namespace bundle_icp
