// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>
#include <bundle_icp/common/rgbd_frame.h>
#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/graph/features.h>
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

  /** The model: coarser than for a mesh, so that noise averages out within a voxel. */
  TSDFOptions volume;
  /** How features are matched with those of the frame before. */
  MatchingOptions matching;
  VirtualDepthOptions depth;
  /** Frames are aligned at a size reduced by this integer factor; the model gets them
   * whole. */
  int depth_reduction = 2;
  /** Share of a frame's depth that must lie on the model; with less it is lost, and not
   * fused: it would spoil the model. On TUM freiburg1_xyz nearly all right poses have
   * 0.65 and more, wrong ones up to 0.55. */
  double min_overlap = 0.6;
  /** The same, of a pose close to one that matched features agree on: they vouch for
   * it. */
  double min_overlap_with_features = 0.3;
  int num_threads = 0; ///< 0 = all; overrides those of the parts

  bool
  isValid(std::string* error = nullptr) const;
};

/** What became of a frame. */
struct TrackedFrame {
  bool is_tracked = false;
  std::string reason;                        ///< why it is lost
  Pose world_from_camera = Pose::Identity(); ///< the world is the first frame's camera
  std::size_t matches = 0;                   ///< of features, with the last tracked frame
  std::size_t inliers = 0;                   ///< those that agree with the pose
  double overlap = 0;                        ///< share of the depth that lies on the model
  double icp_rmse = 0;                       ///< distance to the model [m]
};

/** Frame-to-model tracking of KinectFusion (Newcombe et al., ISMAR 2011): each frame is
 * aligned by ICP with the ray-cast volume of all frames before, then fused into it.
 *
 *  ICP starts from the pose that features matched with the last tracked frame agree on,
 * where given and found; then from constant velocity; then from the last pose. The
 * first start that brings the frame onto the model serves, else the best. A frame that
 * cannot be aligned is lost: the next is tried from the last good pose. Poses are never
 * corrected later; frames have to come in the order of time.
 *
 *  \code
 *  FrameToModelTracker tracker(dataset.camera());
 *  for (std::size_t i = 0; i < dataset.size(); ++i)
 *    if (const TrackedFrame frame = tracker.track(dataset.read(i)); frame.is_tracked)
 *      use(frame.world_from_camera);
 *  \endcode
 *
 *  The result does not depend on the number of threads. */
class BUNDLE_ICP_EXPORT FrameToModelTracker {
public:
  using Ptr = std::shared_ptr<FrameToModelTracker>;
  using ConstPtr = std::shared_ptr<const FrameToModelTracker>;

  /** \throws pcl::BadArgumentException for invalid options or camera. */
  explicit FrameToModelTracker(const CameraIntrinsics& camera, const TrackingOptions& options = {});
  ~FrameToModelTracker();

  /** Tracks the next frame; its time stamp gives the velocity.
   *  \param features those of the frame for a visual start; none: depth alone
   *  \throws pcl::BadArgumentException for images of wrong type or size. */
  TrackedFrame
  track(const RGBDFrame& frame, const Features& features = {});

  /** The model so far. */
  const TSDFVolume&
  volume() const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace bundle_icp
