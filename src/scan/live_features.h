// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/graph/feature_matching.h>
#include <bundle_icp/registration/visual_pose.h>

#include <optional>
#include <vector>

namespace bundle_icp {

/** A small, blurred, grey picture of an image as a row of numbers: the product of two of them tells
 *  how alike the images are, at most 1 (Klein and Murray, ECCV 2008). That of an image of one
 *  colour is 0. */
cv::Mat
thumbnailOf(const cv::Mat& color);

/** A frame with features whose pose is known. */
struct KnownFeatures {
  const Features* features = nullptr;
  Pose world_from_camera = Pose::Identity();
};

/** Matches of a frame with known frames, and the pose that they support. */
struct VisualMatches {
  VisualCorrespondences points;
  std::optional<RigidAlignment> pose; ///< world_from_camera; unset when too few agree on one
};

/** Algorithm 1, lines 1 and 2, without tracks. */
VisualMatches
matchWithKnown(const Features& features, const std::vector<KnownFeatures>& known,
               const CameraIntrinsics& camera, const MatchingOptions& options,
               std::size_t min_inliers);

} // namespace bundle_icp
