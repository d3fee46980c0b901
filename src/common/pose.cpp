// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/common/pose.h>

#include <Eigen/SVD>
#include <cmath>

namespace bundle_icp {

Pose
increment(const Vector6d& delta)
{
  Pose pose = Pose::Identity();
  const Eigen::Vector3d omega = delta.head<3>();
  const double angle = omega.norm();
  if (angle > 0)
    pose.linear() = Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix();
  pose.translation() = delta.tail<3>();
  return pose;
}

Vector6d
logarithm(const Pose& pose)
{
  // Through the quaternion: exact for small angles, where acos of the trace is not.
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0)
    q.coeffs() *= -1;
  const double sine = q.vec().norm();
  const double angle = 2 * std::atan2(sine, q.w());
  Vector6d delta;
  delta.head<3>() = (sine > 1e-12 ? angle / sine : 2.0) * q.vec();
  delta.tail<3>() = pose.translation();
  return delta;
}

double
rotationAngle(const Pose& pose)
{
  return logarithm(pose).head<3>().norm();
}

Eigen::Matrix3d
crossMatrix(const Eigen::Vector3d& v)
{
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

bool
isRigid(const Eigen::Matrix4d& matrix, double tolerance)
{
  if (!matrix.allFinite())
    return false;
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  if (r.determinant() <= 0)
    return false;
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > tolerance)
    return false;
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= tolerance;
}

Pose
closestPose(const Eigen::Matrix4d& matrix)
{
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix.topLeftCorner<3, 3>(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Pose pose = Pose::Identity();
  pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

} // namespace bundle_icp
