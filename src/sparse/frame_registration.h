// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/registration/bundle_icp.h>
#include <bundle_icp/sparse/incremental_mapper.h>

#include "sparse/pose_adjustment.h"

#include <optional>

namespace bundle_icp {

/** Registered neighbour of an image and how many matches they share. */
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

/** Registers single images against a model that does not change meanwhile: Algorithm 1. All
 *  methods may be called from several threads. */
class FrameRegistrar {
public:
  FrameRegistrar(const ImageGraph& graph,
                 const DepthViewProvider& depth_views,
                 const MapperOptions& options)
  : graph_(graph)
  , depth_views_(depth_views)
  , options_(options)
  , shared_depth_sigmas_(options.shared_depth_sigmas)
  {
  }

  /** Whether images have a DepthError of their own, as self-calibration found out: where they have
   *  none, dense evidence weighs what its noise says. */
  void
  setDepthErrors(bool depth_errors);

  /** By visual evidence alone, quickly. */
  FrameRegistration
  registerVisually(const SparseModel& model, std::size_t image, int component) const;

  /** By MapperOptions::method: visual evidence, and virtual depth.
   *  \param num_threads threads inside this one registration */
  FrameRegistration
  registerFrame(const SparseModel& model, std::size_t image, int component, int num_threads) const;

  /** By geometry alone, from a guess, against the virtual depth of `neighbours`. */
  FrameRegistration
  registerFrameByGeometry(const SparseModel& model,
                          std::size_t image,
                          const std::vector<Neighbour>& neighbours,
                          const Pose& guess,
                          int num_threads) const;

  /** How well the points that an image of the model sees, and its dense terms among `terms`, hold
   *  its pose, see ImagePose. */
  Matrix6d
  poseCovariance(const SparseModel& model,
                 std::size_t image,
                 const std::vector<RelativePoseTerm>& terms) const;

  /** Dense evidence on the motion between two images near their present poses; unset when
   *  their surfaces do not meet. */
  std::optional<RelativePoseTerm>
  registerPair(const SparseModel& model, std::size_t first, std::size_t second) const;

  /** Registered neighbours of the component, most matches first. */
  std::vector<Neighbour>
  registeredNeighbours(const SparseModel& model, std::size_t image, int component) const;

private:
  /** Algorithm 1, line 1; `features` are the image's own features of the correspondences. */
  VisualCorrespondences
  findCorrespondences(const SparseModel& model,
                      std::size_t image,
                      const std::vector<Neighbour>& neighbours,
                      std::vector<int>& features) const;

  /** Algorithm 1, line 2, by MapperOptions::method; unset with the reason in the report. */
  std::optional<VisualPose>
  initialPose(const VisualCorrespondences& visual,
              std::size_t image,
              const std::vector<int>& features,
              ImageRegistration& report) const;

  /** Adjusts the pose to pixels, depth and dense evidence. */
  FrameRegistration
  adjusted(const SparseModel& model,
           std::size_t image,
           const VisualCorrespondences& visual,
           const std::vector<int>& features,
           const DensePose& dense,
           const ImageRegistration& report) const;

  /** Whether depth could still improve a pose that was found visually. */
  bool
  canDepthImprove(std::size_t image, const FrameRegistration& visual) const;

  /** The pose in the alignment is that of the depth image. */
  Alignment
  alignToVirtualDepth(const SparseModel& model,
                      std::size_t image,
                      const std::vector<Neighbour>& neighbours,
                      const VisualCorrespondences& visual,
                      const Pose& guess,
                      int num_threads) const;

  const ImageGraph& graph_;
  const DepthViewProvider& depth_views_;
  const MapperOptions& options_;
  bool depth_errors_ = false;
  double shared_depth_sigmas_;
};

} // namespace bundle_icp
