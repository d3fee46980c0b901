// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "mapping/component_adjustment.h"
#include "scan/depth_view_store.h"
#include "scan/live_map.h"

#include <bundle_icp/reconstruction.h>

#include <memory>
#include <optional>
#include <set>
#include <vector>

namespace bundle_icp {

/** Image graph and sparse model of a session's key frames. One thread uses it. */
class LiveSparseModel {
public:
  LiveSparseModel(const CameraIntrinsics& camera, const ReconstructionOptions& options);

  /** Matches a key frame, registers it, and adjusts what it has to do with; tries those again that
   *  could not be registered before. */
  void
  add(NewKeyFrame frame);

  /** The state as of now. */
  std::shared_ptr<const LiveMap>
  snapshot() const;

private:
  std::set<std::size_t>
  partners(const NewKeyFrame& frame) const;
  bool
  registerFrame(std::size_t frame);
  void
  tryAgain();
  void
  adjust();

  std::vector<Eigen::Vector3f>
  pointsOf(std::size_t frame) const;
  void
  forgetCalibration();
  void
  correctViews();

  const ReconstructionOptions options_;
  ImageGraph graph_;
  SparseModel model_;
  std::vector<NewKeyFrame> frames_;                       ///< without images, by node
  std::vector<std::shared_ptr<const Features>> features_; ///< copies that others may hold
  DepthViewStore depths_;
  std::vector<std::shared_ptr<const DepthView>>
      views_; ///< all of depths_, as of the last adjustment
  const DepthViewProvider view_of_;
  std::optional<FrameRegistrar> registrar_;
  std::optional<ComponentAdjuster> adjuster_;
  double next_adjustment_, next_calibration_;
};

} // namespace bundle_icp
