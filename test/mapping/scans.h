// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "landmarks.h"

#include <bundle_icp/common/rigid_alignment.h>
#include <bundle_icp/mapping/incremental_mapper.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace bundle_icp::test {

/** Frames with all that the mapper asks for, and their true poses. */
struct Scan {
  std::vector<ImageNode> nodes;
  std::vector<std::shared_ptr<const DepthView>> views;
  std::vector<Pose> truth;
  CameraIntrinsics camera = room().camera();

  void
  add(const Features& features, const cv::Mat& depth, const Pose& world_from_camera)
  {
    nodes.push_back({features, 0.4 * double(nodes.size())});
    views.push_back(std::make_shared<const DepthView>(makeDepthView(depth, camera, 2, {})));
    truth.push_back(world_from_camera);
  }

  void
  addRoom(const std::vector<std::size_t>& frames)
  {
    for (const std::size_t i : frames)
      add(roomFeatures(i), room().read(i).depth, room().worldFromCamera(i));
  }

  ImageGraph
  graph() const
  {
    ImageGraph result(camera);
    result.append(nodes, true);
    return result;
  }

  DepthViewProvider
  provider() const
  {
    return [this](std::size_t frame, const SparseModel&) { return views[frame]; };
  }
};

struct PoseErrors {
  double distance = 0; ///< [m]
  double angle = 0;    ///< [degrees]
};

/** Largest errors of a component's poses after the best rigid alignment. */
inline PoseErrors
largestErrors(const SparseModel& model, const std::vector<Pose>& truth, int component)
{
  std::vector<PointPair> pairs;
  for (const std::size_t i : model.registeredFrames(component))
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d point =
          k < 3 ? Eigen::Vector3d(Eigen::Vector3d::Unit(k)) : Eigen::Vector3d::Zero();
      pairs.push_back({model.worldFromCamera(i) * point, truth[i] * point});
    }
  const Pose aligned = *rigidAlignment(pairs);
  PoseErrors errors;
  for (const std::size_t i : model.registeredFrames(component)) {
    const Pose error = truth[i].inverse() * aligned * model.worldFromCamera(i);
    errors.distance = std::max(errors.distance, error.translation().norm());
    errors.angle = std::max(errors.angle, degrees(rotationAngle(error)));
  }
  return errors;
}

} // namespace bundle_icp::test
