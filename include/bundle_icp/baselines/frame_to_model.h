// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/rgbd_frame.h>
#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/graph/features.h>
#include <bundle_icp/registration/frame_registration.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>
#include <bundle_icp/volume/tsdf_volume.h>

#include <memory>
#include <string>

namespace bundle_icp {

/** How a FrameToModelTracker works. */
struct BUNDLE_ICP_EXPORT TrackingOptions {
  TrackingOptions()
  {
    volume.voxel_size = 0.01;
    volume.truncation = 0.06;
  }

  /** The model, with coarser voxels than for a mesh, so that noise averages out in them. */
  TSDFOptions volume;
  /** How features are matched with the features of the frame before. */
  MatchingOptions matching;
  VirtualDepthOptions depth;
  /** Frames are reduced by this integer factor before alignment, but fused at full size. */
  int depth_reduction = 2;
  /** Minimum share of a frame's depth that must lie on the model. With less the frame is lost and
   *  not fused, because it would spoil the model. On TUM freiburg1_xyz nearly all right poses have
   *  0.65 and more, wrong poses up to 0.55. */
  double min_overlap = 0.6;
  /** The same for a pose close to the pose of matched features, which confirm it. */
  double min_overlap_with_features = 0.3;
  int num_threads = 0; ///< 0 = all; overrides the num_threads of the fields above

  bool
  isValid(std::string* error = nullptr) const;
};

/** Frame-to-model tracking of KinectFusion (Newcombe et al., ISMAR 2011): ICP aligns each frame
 *  with the ray-cast volume of all earlier frames, then the frame is fused into the volume.
 *
 *  ICP has up to three starts: the pose from features matched with the last tracked frame, if there
 *  are features and such a pose; constant velocity; the last pose. The first start that brings the
 *  frame onto the model counts, else the best start. A frame that cannot be aligned is lost, and
 *  the next frame is tried from the last good pose. Poses are never corrected later. Frames have to
 *  come in time order.
 *
 *   \code
 *   FrameToModelTracker tracker(dataset.camera());
 *   for (std::size_t i = 0; i < dataset.size(); ++i)
 *     if (const FrameRegistration frame = tracker.track(dataset.read(i)); frame.registered)
 *       use(frame.world_from_camera);
 *   \endcode
 *
 *  The result does not depend on the number of threads. */
class BUNDLE_ICP_EXPORT FrameToModelTracker {
public:
  using Ptr = std::shared_ptr<FrameToModelTracker>;
  using ConstPtr = std::shared_ptr<const FrameToModelTracker>;

  /** \throws pcl::BadArgumentException for invalid options or camera. */
  explicit FrameToModelTracker(const CameraIntrinsics& camera, const TrackingOptions& options = {});
  ~FrameToModelTracker();

  /** Tracks the next frame; its time stamp gives the velocity. The world is the camera frame of the
   *  first frame, matches are those with the last tracked frame, and covariances stay unset.
   *  \param features of the frame, for a visual start; none: depth alone
   *  \throws pcl::BadArgumentException for images of wrong type or size. */
  FrameRegistration
  track(const RGBDFrame& frame, const Features& features = {});

  /** The model so far. */
  const TSDFVolume&
  volume() const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
