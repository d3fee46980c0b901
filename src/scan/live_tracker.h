// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/depth_view_store.h"
#include "scan/live_features.h"
#include "scan/live_key_frames.h"

#include <bundle_icp/scan/scan_session.h>

#include <optional>
#include <vector>

namespace bundle_icp {

/** Gives the pose of each frame of a session when it comes, from the key frames that there are. */
class LiveTracker {
public:
  LiveTracker(const CameraIntrinsics& camera, const ScanSessionOptions& options);

  /** Takes over what the mapper has found since. */
  void
  update(const LiveMap& map);

  /** The pose of the next frame, with the images of which key frames are made. */
  LivePose
  track(const RGBDFrame& frame);

  /** The key frame that the last frame has become, if any, to be mapped.
   *  \param num_waiting key frames that are not mapped yet: with many of them only what is needed
   *  becomes one */
  std::optional<NewKeyFrame>
  chooseKeyFrame(std::size_t num_waiting);

  const std::vector<LiveKeyFrame>&
  keyFrames() const
  {
    return key_frames_;
  }

  /** Corrections to the camera that the mapper has found. */
  const Calibration&
  calibration() const
  {
    return calibration_;
  }

  /** Pose of each frame as it is known now; unset for those that are lost or doubtful. */
  std::vector<std::optional<Pose>>
  poses() const;

private:
  /** A pose relative to a key frame, which may still move. Both are those when depth was taken. */
  struct Anchor {
    std::size_t key = 0;
    Pose key_from_depth = Pose::Identity();
    Pose depth_from_color = Pose::Identity();
  };
  struct PastFrame {
    Anchor anchor;
    double timestamp = 0; ///< [s]
  };
  LivePose
  begin() const;
  std::optional<Pose>
  guess(double timestamp) const;
  LivePose
  findPose();
  LivePose
  align(const Pose& start, const VisualMatches* matched);
  bool
  refine(LivePose& pose);
  VisualMatches
  matchWithKeyFrames(const std::optional<Pose>& guess);
  void
  remember();
  bool
  isKeyNeeded(std::size_t num_waiting) const;
  bool
  isTried(std::size_t num_waiting);
  void
  useMotionTo(const Pose& world_from_depth);
  Pose
  poseOf(const Anchor& anchor) const
  {
    return *key_frames_[anchor.key].world_from_depth * anchor.key_from_depth;
  }

  const CameraIntrinsics camera_;
  const ScanSessionOptions options_;
  std::vector<LiveKeyFrame> key_frames_;
  std::vector<std::optional<Anchor>> frames_; ///< of all frames so far
  std::optional<PastFrame> last_, before_last_;
  Calibration calibration_;
  bool is_sure_ = false;        ///< the last frame's pose was good
  std::size_t since_tried_ = 0; ///< frames since a lost frame was last given to the mapper
  // Of the frame that was tracked last
  RGBDFrame frame_;
  std::shared_ptr<const DepthView> view_;
  std::optional<Features> features_;
  std::vector<Covisible> covisible_; ///< at its pose
  double agreement_ = 0;             ///< BundleICPResult::agreement of its pose
  PatchImages patch_images_;
  Matrix6d information_ = Matrix6d::Zero(); ///< of its depth, on motions on the left of its pose
  Vector6d motion_ = Vector6d::Zero();      ///< see SparseModel::motion()
  Pose depth_from_color_ = Pose::Identity(), world_from_depth_ = Pose::Identity();
  LivePose pose_;
};

} // namespace bundle_icp
