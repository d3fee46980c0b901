// SPDX-License-Identifier: BSD-3-Clause
#include <bundle_icp/common/pose.h>

#include <gtest/gtest.h>

using namespace bundle_icp;

TEST(Pose, LogarithmInvertsIncrement)
{
  for (const double angle : {0.0, 1e-9, 1e-4, 0.3, 3.0}) {
    Vector6d delta;
    delta.head<3>() = angle * Eigen::Vector3d(1, -2, 0.5).normalized();
    delta.tail<3>() = Eigen::Vector3d(0.1, -3, 2);
    EXPECT_LT((logarithm(increment(delta)) - delta).norm(), 1e-12) << angle;
    EXPECT_NEAR(rotationAngle(increment(delta)), angle, 1e-12);
  }
}

TEST(Pose, CrossMatrixIsTheCrossProduct)
{
  const Eigen::Vector3d v(1, 2, 3), w(-0.3, 5, 0.1);
  EXPECT_LT((crossMatrix(v) * w - v.cross(w)).norm(), 1e-15);
}

TEST(Pose, RefusesWhatIsNotRigid)
{
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  EXPECT_TRUE(isRigid(m));
  m(0, 0) = -1; // a reflection
  EXPECT_FALSE(isRigid(m));
  m.setIdentity();
  m(0, 3) = std::nan("");
  EXPECT_FALSE(isRigid(m));
  m.setIdentity();
  m.topLeftCorner<3, 3>() *= 1.1; // a scale
  EXPECT_FALSE(isRigid(m));
}

TEST(Pose, ClosestPoseIsOrthonormal)
{
  Eigen::Matrix4d m = increment((Vector6d() << 0.1, 0.2, -0.3, 1, 2, 3).finished()).matrix();
  m(0, 0) += 3e-4;
  const Pose pose = closestPose(m);
  EXPECT_LT((pose.linear().transpose() * pose.linear() - Eigen::Matrix3d::Identity()).norm(),
            1e-14);
  EXPECT_LT((pose.matrix() - m).norm(), 4e-4);
}
