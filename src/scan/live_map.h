// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/graph/features.h>
#include <bundle_icp/virtual_depth/virtual_depth.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <memory>
#include <optional>
#include <vector>

namespace bundle_icp {

/** A frame that extends the model of a session. Key frames have numbers in the order in which they
 *  are chosen, which are those of the image graph's nodes. */
struct NewKeyFrame {
  RGBDFrame images;
  cv::Mat thumbnail;                ///< see thumbnailOf()
  std::optional<Features> features; ///< where they are known already
  /** Pose by tracking when colour was taken; unset when the frame was lost or doubtful. */
  std::optional<Pose> tracked;
  Vector6d motion = Vector6d::Zero(); ///< see SparseModel::motion()
  std::vector<std::size_t> covisible; ///< key frames that see the same, most first
};

/** What the mapper knows of a key frame. */
struct MappedKeyFrame {
  std::optional<Pose> world_from_camera;    ///< unset until it is registered
  Pose depth_from_color = Pose::Identity(); ///< see SparseModel::depthFromColor()
  std::shared_ptr<const DepthView> view;    ///< corrected as the model's calibration says
  std::shared_ptr<const Features> features; ///< null until they are found
  std::vector<Eigen::Vector3f> points;      ///< of the features, in the world [m]; NaN = unknown
};

/** State of the mapper at one moment, which nobody changes any more. */
struct LiveMap {
  std::vector<MappedKeyFrame> key_frames;
  Calibration calibration;
  std::size_t edges = 0;
  pcl::PointCloud<pcl::PointXYZRGB>::ConstPtr points;
};

} // namespace bundle_icp
