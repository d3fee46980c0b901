// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#pragma once

#include <bundle_icp/export.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace bundle_icp {

/** A rigid motion. Variables are named `target_from_source`: `world_from_camera * x_in_camera` is
 *  the point in the world. Camera frames follow OpenCV: x right, y down, z forward; metres. */
using Pose = Eigen::Isometry3d;

/** A small motion: rotation vector [rad] first, translation [m] second. */
using Vector6d = Eigen::Matrix<double, 6, 1>;
/** A quadratic form over a Vector6d, in the order of Vector6d. */
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/** The motion (exp(rotation vector), translation). Rotation and translation are kept apart, so that
 *  small motions compose by addition, to first order. An information matrix in this library is that
 *  of such a motion applied on the left: `increment(delta) * pose`. */
BUNDLE_ICP_EXPORT Pose
increment(const Vector6d& delta);

/** Inverse of increment(): rotation vector and translation of a pose. */
BUNDLE_ICP_EXPORT Vector6d
logarithm(const Pose& pose);

/** Angle of the pose's rotation [rad], 0 to pi. */
BUNDLE_ICP_EXPORT double
rotationAngle(const Pose& pose);

/** The matrix [v]x with [v]x w = v x w. */
BUNDLE_ICP_EXPORT Eigen::Matrix3d
crossMatrix(const Eigen::Vector3d& v);

/** True when all entries are finite and the linear part is a rotation within `tolerance`
 *  (largest entry of R^T R - I, and det R > 0). */
BUNDLE_ICP_EXPORT bool
isRigid(const Eigen::Matrix4d& matrix, double tolerance = 1e-3);

/** The rigid motion closest to a matrix that isRigid(): the rotation is orthonormalised. */
BUNDLE_ICP_EXPORT Pose
closestPose(const Eigen::Matrix4d& matrix);

} // namespace bundle_icp
