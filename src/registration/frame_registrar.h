// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/frame_registration.h>
#include <bundle_icp/registration/point_alignment.h>

#include "adjustment/pose_adjustment.h"
#include "registration/depth_alignment.h"

#include <optional>

namespace bundle_icp {

/** Registered neighbour of an image, and the number of matches that the two images share. */
struct Neighbour {
  std::size_t image = 0;
  std::size_t matches = 0;
};

/** Pose of an image found by Bundle ICP, or the reason why there is none. */
struct FrameRegistration {
  Pose world_from_camera = Pose::Identity();
  DepthError depth_error = DepthError::Zero();
  /** Of the camera's rotation and position, see ImagePose. */
  Matrix6d covariance = Matrix6d::Identity();
  ImageRegistration report;
};

/** An image to register, and its registered neighbours. */
struct NewFrame {
  std::size_t image = 0;
  std::vector<Neighbour> neighbours; ///< registered images, best first
  /** Where ICP starts without visual evidence: geometry alone then decides. */
  std::optional<Pose> guess;
  int num_threads = 0; ///< inside this one registration
};

/** Bundle ICP, Algorithm 1: registers single images against a model that does not change meanwhile.
 *  Several threads may call all methods. */
class FrameRegistrar {
public:
  FrameRegistrar(const ImageGraph& graph, const DepthViewProvider& depth_views,
                 const FrameRegistrationOptions& options, const BundleAdjustmentOptions& adjustment)
  : graph_(graph), depth_views_(depth_views), options_(options), adjustment_(adjustment),
    shared_depth_sigmas_(options.shared_depth_sigmas)
  {
  }

  /** True: images have a DepthError of their own, as self-calibration found. False: dense evidence
   *  gets the weight of its noise alone. */
  void
  setDepthErrors(bool depth_errors);

  /** An image of the graph, to be registered with its neighbours in a component: from its matches,
   *  or, without FrameRegistrationOptions::visual_start, from the pose of the neighbour that shares
   *  most of them. */
  NewFrame
  newFrame(const SparseModel& model, std::size_t image, int component, int num_threads) const;

  /** Algorithm 1 of the paper, for FrameRegistrationOptions::method. */
  FrameRegistration
  bundleICP(const SparseModel& model, const NewFrame& frame) const;

  /** Lines 1 and 2 of Algorithm 1 alone, quickly. */
  FrameRegistration
  registerVisually(const SparseModel& model, const NewFrame& frame) const;

  /** How well the pose of an image of the model is held by the points that the image sees and by
   *  its dense terms among `terms`, see ImagePose. */
  Matrix6d
  poseCovariance(const SparseModel& model, std::size_t image,
                 const std::vector<RelativePoseTerm>& terms) const;

  /** Dense evidence on the motion between two images near their present poses; unset when
   *  their surfaces do not meet. */
  std::optional<RelativePoseTerm>
  registerPair(const SparseModel& model, std::size_t first, std::size_t second) const;

  /** Registered neighbours of the component, most matches first. */
  std::vector<Neighbour>
  registeredNeighbours(const SparseModel& model, std::size_t image, int component) const;

private:
  /** Matches of a new frame to registered frames, and the new frame's features in these matches. */
  struct Correspondences {
    VisualCorrespondences points;
    std::vector<int> features;
  };

  Correspondences
  findCorrespondences(const SparseModel& model, const NewFrame& frame) const;

  std::optional<VisualPose>
  initialPose(const NewFrame& frame, const Correspondences& matches,
              ImageRegistration& report) const;

  bool
  canDepthImprove(std::size_t image, const FrameRegistration& visual) const;

  void
  showVirtualDepth(const SparseModel& model, const NewFrame& frame, const Pose& start,
                   DepthAlignment& alignment) const;

  VirtualDepthOptions
  virtualDepthOptions(int num_threads) const;

  bool
  isEvidence(const BundleICPResult& dense, ImageRegistration& report) const;

  DensePose
  denseEvidence(const SparseModel& model, std::size_t image, const BundleICPResult& dense) const;

  /** Pose of visual and dense evidence together, each counted once. */
  FrameRegistration
  adjusted(const SparseModel& model, std::size_t image, const Correspondences& matches,
           const DensePose& dense, const ImageRegistration& report) const;

  const ImageGraph& graph_;
  const DepthViewProvider& depth_views_;
  const FrameRegistrationOptions& options_;
  const BundleAdjustmentOptions& adjustment_;
  bool depth_errors_ = false;
  double shared_depth_sigmas_;
};

} // namespace bundle_icp
