// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include "scan/live_map.h"
#include "scan/live_patches.h"

#include <memory>
#include <optional>
#include <vector>

namespace bundle_icp {

/** A key frame as it is known now. */
struct LiveKeyFrame {
  std::size_t frame = 0; ///< number in the session
  double timestamp = 0;
  std::shared_ptr<const DepthView> view;
  cv::Mat colors;    ///< CV_8UC3, of the view's size
  cv::Mat thumbnail; ///< tells images of the same place, see thumbnailOf()
  PatchImages patch_images;
  std::shared_ptr<const Features> features;     ///< null until they are found
  std::vector<Eigen::Vector3f> points;          ///< of the features, see MappedKeyFrame
  std::optional<Pose> world_from_depth;         ///< when depth was taken; unset while it is lost
  Pose depth_from_color = Pose::Identity();     ///< motion of the camera between the two
  std::optional<std::size_t> reference;         ///< key frame that its pose was found with
  Pose reference_from_depth = Pose::Identity(); ///< by tracking
  bool is_mapped = false;
};

/** Takes over what the mapper has found. Those that are not mapped yet follow their reference. */
void
update(const LiveMap& map, std::vector<LiveKeyFrame>& key_frames);

/** Share of a view's depth that a key frame sees as well. */
struct Covisible {
  std::size_t key = 0;
  double share = 0;
};

/** Key frames that see the same as a view from a pose, those that see most of it first. */
std::vector<Covisible>
findCovisible(const std::vector<LiveKeyFrame>& key_frames, const DepthView& view,
              const Pose& world_from_depth);

} // namespace bundle_icp
