// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/frame_registration.h>
#include <bundle_icp/registration/impl/point_alignment.h>

#include "adjustment/pose_adjustment.h"
#include "registration/depth_alignment.h"

#include <optional>

namespace bundle_icp {

/** Registered neighbour of a frame, and the number of matches that the two frames share. */
struct Neighbour {
  std::size_t frame = 0;
  std::size_t matches = 0;
};

/** A frame to register, and its registered neighbours. */
struct NewFrame {
  std::size_t index = 0;
  std::vector<Neighbour> neighbours; ///< registered frames, best first
  /** Where ICP starts without visual evidence: geometry alone then decides. */
  std::optional<Pose> guess;
  int num_threads = 0; ///< inside this one registration
};

/** Bundle ICP, Algorithm 1: registers single frames against a model that does not change meanwhile.
 *  Several threads may call all methods. */
class FrameRegistrar {
public:
  FrameRegistrar(const ImageGraph& graph, const DepthViewProvider& depth_views,
                 const FrameRegistrationOptions& options, const BundleAdjustmentOptions& adjustment)
  : graph_(graph), depth_views_(depth_views), options_(options), adjustment_(adjustment),
    shared_depth_sigmas_(options.shared_depth_sigmas)
  {
  }

  /** True: frames have a DepthError of their own, as self-calibration found. False: dense evidence
   *  gets the weight of its noise alone. */
  void
  setDepthErrors(bool depth_errors);

  /** A frame of the graph, to be registered with its neighbours in a component: from its matches,
   *  or, without FrameRegistrationOptions::visual_start, from the pose of the neighbour that shares
   *  most of them. */
  NewFrame
  newFrame(const SparseModel& model, std::size_t frame, int component, int num_threads) const;

  /** Algorithm 1 of the paper, for FrameRegistrationOptions::method. */
  FrameRegistration
  bundleICP(const SparseModel& model, const NewFrame& new_frame) const;

  /** Lines 1 and 2 of Algorithm 1 alone, quickly. */
  FrameRegistration
  registerVisually(const SparseModel& model, const NewFrame& new_frame) const;

  /** Lines 3 to 7 of Algorithm 1 alone, from a guess that is right within some centimetres.
   *  \return the pose of the camera when depth was taken */
  BundleICPResult
  alignDepth(const SparseModel& model, const NewFrame& new_frame) const;

  /** How well the pose of a frame of the model is held by the points that the frame sees and by
   *  its dense terms among `terms`, see PoseEstimate. */
  Matrix6d
  poseCovariance(const SparseModel& model, std::size_t frame,
                 const std::vector<RelativePoseTerm>& terms) const;

  /** Dense evidence on the motion between two frames near their present poses; unset when
   *  their surfaces do not meet. */
  std::optional<RelativePoseTerm>
  registerPair(const SparseModel& model, std::size_t first, std::size_t second) const;

  /** Registered neighbours of the component, most matches first. */
  std::vector<Neighbour>
  registeredNeighbours(const SparseModel& model, std::size_t frame, int component) const;

  /** Gives the views that frames are registered with. */
  const DepthViewProvider&
  depthViews() const
  {
    return depth_views_;
  }

private:
  /** Matches of a new frame to registered frames, and the new frame's features in these matches. */
  struct Correspondences {
    VisualCorrespondences points;
    std::vector<int> features;
  };

  Correspondences
  findCorrespondences(const SparseModel& model, const NewFrame& new_frame) const;

  std::optional<RigidAlignment>
  initialPose(const NewFrame& new_frame, const Correspondences& matches,
              FrameRegistration& registration) const;

  bool
  canDepthImprove(std::size_t frame, const FrameRegistration& visual) const;

  void
  showVirtualDepth(const SparseModel& model, const NewFrame& new_frame, const Pose& start,
                   DepthAlignment& alignment) const;

  VirtualDepthOptions
  virtualDepthOptions(int num_threads) const;

  bool
  isEvidence(const BundleICPResult& dense, FrameRegistration& registration) const;

  DensePoseTerm
  denseEvidence(const SparseModel& model, std::size_t frame, const BundleICPResult& dense) const;

  /** Pose of visual and dense evidence together, each counted once. */
  FrameRegistration
  adjusted(const SparseModel& model, std::size_t frame, const Correspondences& matches,
           const DensePoseTerm& dense, FrameRegistration registration) const;

  const ImageGraph& graph_;
  const DepthViewProvider& depth_views_;
  const FrameRegistrationOptions& options_;
  const BundleAdjustmentOptions& adjustment_;
  bool depth_errors_ = false;
  double shared_depth_sigmas_;
};

} // namespace bundle_icp
