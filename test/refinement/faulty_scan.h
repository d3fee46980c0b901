// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/refinement/self_calibration.h>

#include "faulty_camera.h"
#include "mapping/frame_motions.h"

#include <gtest/gtest.h>

#include <numeric>
#include <string>
#include <vector>

namespace bundle_icp::test {

inline const Landmarks&
landmarks()
{
  static const Landmarks all(200);
  return all;
}

inline ImageGraph
toGraph(const std::vector<FaultyView>& views, double time_step)
{
  std::vector<ImageNode> nodes;
  for (const FaultyView& view : views)
    nodes.push_back({view.view.features, time_step * double(nodes.size())});
  ImageGraph graph(landmarks().camera());
  graph.append(nodes, true);
  return graph;
}

/** A scan by a faulty camera, as it is when the mapper calibrates it: registered,
 * adjusted without corrections, motions estimated from the poses. */
struct FaultyScan {
  std::vector<FaultyView> views;
  ImageGraph graph;
  SparseModel model;
  std::vector<std::size_t> frames;

  /** \param time_step between the stamps that the library gets; 0 = the true one */
  explicit FaultyScan(const FaultyCamera& camera, unsigned count = 30, double time_step = 0)
  : views(recordWrongly(landmarks(), camera, count)),
    graph(toGraph(views, time_step > 0 ? time_step : 1 / camera.rate)), model(count), frames(count)
  {
    std::iota(frames.begin(), frames.end(), std::size_t(0));
    for (const std::size_t i : frames)
      model.registerFrame(graph, i, views[i].view.world_from_camera, 0, {});
    adjust({});
    estimateMotions(graph, 0, model);
  }

  BundleAdjustmentProblem
  problem(const SelfCalibrationResult& result) const
  {
    BundleAdjustmentProblem problem;
    problem.variable = frames;
    problem.calibrated = result.calibrated;
    problem.depth_errors = result.depth_errors;
    return problem;
  }

  void
  adjust(const SelfCalibrationResult& result)
  {
    ASSERT_TRUE(adjustBundle(graph, problem(result), {}, model).success);
  }

  SelfCalibrationResult
  calibrate(const SelfCalibrationOptions& options = {})
  {
    return selfCalibrate(graph, frames, {}, options, model);
  }
};

inline std::string
report(const SelfCalibrationResult& result)
{
  std::string text;
  for (const CalibrationTest& test : result.tests)
    text += test.name + (test.applied ? ": applied, " : ": refused, ") + "gain " +
            std::to_string(test.gain) + ", significance " + std::to_string(test.significance) +
            "\n";
  return text;
}

} // namespace bundle_icp::test
