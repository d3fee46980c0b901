// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/adjustment/bundle_adjustment.h>

#include "landmarks.h"

#include <algorithm>
#include <random>
#include <vector>

namespace bundle_icp::test {

/** Exact views of landmarks, all registered at their true poses. */
struct LandmarkScene {
  Landmarks landmarks{150};
  std::vector<LandmarkView> views;
  ImageGraph graph;
  SparseModel model;
  BundleAdjustmentProblem problem;

  explicit LandmarkScene(unsigned num_frames = 6)
  : views(landmarkViews(landmarks, num_frames)), graph(toGraph(landmarks, views)), model(num_frames)
  {
    for (std::size_t i = 0; i < views.size(); ++i) {
      model.registerFrame(graph, i, views[i].world_from_camera, 0, {});
      problem.variable.push_back(i);
    }
  }

  /** Moves all poses but the first, and all points. */
  void
  perturb()
  {
    for (std::size_t i = 1; i < views.size(); ++i)
      model.setWorldFromCamera(i, randomMotion(i, 0.01, 0.02) * views[i].world_from_camera);
    for (std::size_t p = 0; p < model.points().size(); ++p)
      model.setPosition(p, randomMotion(p, 0, 0.02) * model.points()[p].position);
  }

  double
  largestPoseError() const
  {
    double largest = 0;
    for (std::size_t i = 0; i < views.size(); ++i)
      largest = std::max(
          largest,
          logarithm(model.worldFromCamera(i) * views[i].world_from_camera.inverse()).norm());
    return largest;
  }

  double
  largestPointError() const
  {
    double largest = 0;
    for (const ScenePoint& point : model.points())
      if (!point.track.empty()) {
        const Observation& o = point.track.front();
        const int landmark = views[o.frame].landmarks[o.feature];
        largest = std::max(largest, (landmarks.point(landmark) - point.position).norm());
      }
    return largest;
  }
};

/** A scene whose pixels are off by half a pixel, some by more than can be true. */
struct NoisyScene : LandmarkScene {
  explicit NoisyScene(unsigned num_frames) : LandmarkScene(num_frames)
  {
    std::mt19937 random(3);
    std::normal_distribution<float> normal(0, 0.5f);
    for (LandmarkView& view : views)
      for (std::size_t j = 0; j < view.features.size(); ++j)
        view.features.pixels[j] +=
            (j % 20 == 0 ? 5.0f : 1.0f) * Eigen::Vector2f(normal(random), normal(random));
    graph = toGraph(landmarks, views);
    perturb();
  }
};

/** Adds each kind of term and unknown that an adjustment can have. */
inline void
complicate(NoisyScene& scene)
{
  scene.problem.depth_errors = true;
  scene.problem.calibrated = {CalibrationParameter::FOCAL_X, CalibrationParameter::DEPTH_BIAS};
  for (std::size_t i = 0; i + 2 < scene.views.size(); ++i) {
    RelativePoseTerm term{i, i + 2};
    term.first_from_second = randomMotion(i, 0.002, 0.002) *
                             scene.views[i].world_from_camera.inverse() *
                             scene.views[i + 2].world_from_camera;
    term.information = 1e5 * Matrix6d::Identity();
    scene.problem.relative_poses.push_back(term);
  }
}

constexpr AdjustmentSolver SOLVERS[] = {AdjustmentSolver::SCHUR, AdjustmentSolver::CERES};

} // namespace bundle_icp::test
