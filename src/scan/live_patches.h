// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/common/calibration.h>
#include <bundle_icp/common/camera_intrinsics.h>
#include <bundle_icp/common/pose.h>

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace bundle_icp {

/** The grey images that patches are compared in, of a quarter and of half the size: the first leads
 *  near, the second tells exactly. */
using PatchImages = std::array<cv::Mat, 2>;

PatchImages
patchImages(const cv::Mat& color);

/** A key frame's image, and where it shows points of the model. */
struct PatchSource {
  cv::Mat image; ///< one of PatchImages
  Pose world_from_camera = Pose::Identity();
  const std::vector<Eigen::Vector2f>* pixels = nullptr; ///< of the full image
  const std::vector<Eigen::Vector3f>* points = nullptr; ///< in the world [m]; NaN = unknown
};

/** A camera while it takes an image. */
struct MovingCamera {
  CameraIntrinsics camera;
  CalibrationVector calibration = CalibrationVector::Zero();
  Vector6d motion = Vector6d::Zero(); ///< see SparseModel::motion()
};

/** A point of the model, and where a new image shows it. */
struct SeenPoint {
  Eigen::Vector3d point; ///< in the world [m]
  Eigen::Vector2d pixel; ///< of the full image
};

/** Finds points of a key frame in an image, near to where a pose expects them (Baker and Matthews,
 *  IJCV 2004: inverse compositional, by translation and brightness). Those that look different are
 *  left out. \param image of the size of the source's */
std::vector<SeenPoint>
findPatches(const PatchSource& source, const cv::Mat& image, const MovingCamera& camera,
            const Pose& world_from_camera);

/** A pose from the points that it sees, and what is known of it besides. */
struct PatchPose {
  Pose world_from_camera = Pose::Identity();
  std::size_t inliers = 0;                 ///< points that agree with it
  Matrix6d information = Matrix6d::Zero(); ///< on motions on the left, of all evidence
};

/** \param other the best pose of other evidence
 *  \param information of that evidence, on motions on the left of the pose */
PatchPose
poseFromPatches(const std::vector<SeenPoint>& seen, const MovingCamera& camera, const Pose& start,
                const Pose& other, const Matrix6d& information);

} // namespace bundle_icp
