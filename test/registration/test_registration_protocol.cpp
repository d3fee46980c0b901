// SPDX-License-Identifier: BSD-3-Clause
// What pcl::Registration promises its users, row by row.
#include "scenes.h"

#include <bundle_icp/registration/bundle_icp.h>

#include <gtest/gtest.h>
#include <pcl/registration/incremental_registration.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;

Cloud::Ptr
frame(std::size_t i)
{
  return toPointCloud(makeDepthView(room().readExact(i).depth, room().camera()));
}

class RegistrationProtocol : public ::testing::Test {
protected:
  RegistrationProtocol()
  {
    reg.setCameraIntrinsics(room().camera());
    reg.setInputSource(source);
    reg.setInputTarget(target);
  }

  void
  align()
  {
    reg.align(out, guess);
  }

  const Cloud::Ptr source = frame(5), target = frame(3);
  const Pose truth = room().worldFromCamera(3).inverse() * room().worldFromCamera(5);
  const Eigen::Matrix4f guess = (truth * randomMotion(1, 0.05, 0.03)).matrix().cast<float>();
  BundleICP<Point, Point> reg;
  Cloud out;
};

} // namespace

TEST_F(RegistrationProtocol, EveryInheritedGetterAfterAlign)
{
  align();
  EXPECT_TRUE(reg.hasConverged());
  EXPECT_EQ(reg.getClassName(), "BundleICP");
  EXPECT_LT((reg.getFinalTransformation() - truth.matrix().cast<float>()).norm(), 2e-3);
  // The last step was smaller than the epsilon that ended the loop.
  EXPECT_LT((reg.getLastIncrementalTransformation() - Eigen::Matrix4f::Identity()).norm(), 1e-3);
  EXPECT_EQ(reg.getInputSource(), source);
  EXPECT_EQ(reg.getInputTarget(), target);
  EXPECT_EQ(reg.getMaximumIterations(), 100);
  EXPECT_EQ(reg.getTransformationEpsilon(), 1e-8);
  EXPECT_GT(reg.getResult().iterations, 0);
  // Mean squared distance to the nearest sample of a grid that is about 10 mm wide.
  EXPECT_LT(reg.getFitnessScore(0.01), 1e-3);
  EXPECT_LT(reg.getFitnessScore(), 0.05);
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::CONVERGED);
}

TEST_F(RegistrationProtocol, OutputIsTheMovedSource)
{
  align();
  ASSERT_EQ(out.width, source->width);
  ASSERT_EQ(out.height, source->height);
  const std::size_t i = 100 * 320 + 150;
  const Eigen::Matrix4f T = reg.getFinalTransformation();
  const Eigen::Vector3f moved =
      T.topLeftCorner<3, 3>() * (*source)[i].getVector3fMap() + T.topRightCorner<3, 1>();
  EXPECT_LT((out[i].getVector3fMap() - moved).norm(), 1e-5);
  const Eigen::Vector3f normal = T.topLeftCorner<3, 3>() * (*source)[i].getNormalVector3fMap();
  EXPECT_LT((out[i].getNormalVector3fMap() - normal).norm(), 1e-5);
}

TEST_F(RegistrationProtocol, NullOrEmptySourceIsDroppedAndAlignFailsVisibly)
{
  for (const Cloud::Ptr& bad : {Cloud::Ptr(), Cloud::Ptr(new Cloud)}) {
    reg.setInputSource(source);
    align();
    ASSERT_TRUE(reg.hasConverged());
    reg.setInputSource(bad);
    EXPECT_FALSE(reg.hasConverged());
    EXPECT_EQ(reg.getInputSource(), nullptr);
    align();
    EXPECT_FALSE(reg.hasConverged());
    EXPECT_EQ(reg.getResult().status, BundleICPStatus::NOT_RUN);
    EXPECT_EQ(reg.getFinalTransformation(), Eigen::Matrix4f::Identity());
  }
}

TEST_F(RegistrationProtocol, NullOrEmptyTargetIsDroppedAndAlignFailsVisibly)
{
  for (const Cloud::Ptr& bad : {Cloud::Ptr(), Cloud::Ptr(new Cloud)}) {
    reg.setInputTarget(target);
    align();
    ASSERT_TRUE(reg.hasConverged());
    reg.setInputTarget(bad);
    EXPECT_FALSE(reg.hasConverged());
    EXPECT_EQ(reg.getInputTarget(), nullptr);
    align();
    EXPECT_FALSE(reg.hasConverged());
    EXPECT_EQ(reg.getResult().iterations, 0);
  }
}

TEST_F(RegistrationProtocol, NewInputsForgetTheOldResult)
{
  align();
  reg.setInputSource(frame(6));
  EXPECT_FALSE(reg.hasConverged());
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::NOT_RUN);
  reg.setInputSource(source);
  align();
  const BundleICPResult first = reg.getResult();
  align();
  EXPECT_EQ(reg.getResult().iterations, first.iterations);
  EXPECT_EQ(reg.getResult().information, first.information);
  EXPECT_EQ(reg.getResult().degenerate_directions.size(), first.degenerate_directions.size());
}

TEST_F(RegistrationProtocol, GuessThatIsNotRigidIsRefused)
{
  align();
  Eigen::Matrix4f bad = guess;
  bad(0, 3) = std::nanf("");
  reg.align(out, bad);
  EXPECT_FALSE(reg.hasConverged());
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::INVALID_INPUT);
  EXPECT_EQ(reg.getFinalTransformation(), Eigen::Matrix4f::Identity());
}

TEST_F(RegistrationProtocol, CloudsThatDoNotMeetAreReported)
{
  Eigen::Matrix4f away = guess;
  away.topRightCorner<3, 1>() += Eigen::Vector3f(0, 0, -50);
  reg.align(out, away);
  EXPECT_FALSE(reg.hasConverged());
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::TOO_FEW_CORRESPONDENCES);
  EXPECT_EQ(reg.getResult().inliers, 0u);
  EXPECT_LT((reg.getFinalTransformation() - away).norm(), 1e-5) << "the pose stays the guess";
}

TEST_F(RegistrationProtocol, SourceWithoutAFinitePointIsRefused)
{
  Cloud::Ptr nothing(new Cloud(*source));
  for (Point& p : *nothing)
    p.x = p.y = p.z = std::nanf("");
  reg.setInputSource(nothing);
  align();
  EXPECT_FALSE(reg.hasConverged());
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::INVALID_INPUT);
}

TEST_F(RegistrationProtocol, IndicesRestrictWhatIsAlignedAndReturned)
{
  // The rest of the source is displaced: only the subset can give the right pose.
  Cloud::Ptr half(new Cloud(*source));
  pcl::IndicesPtr indices(new pcl::Indices);
  for (std::size_t i = 0; i < half->size(); ++i)
    if (i % 320 < 160)
      indices->push_back(int(i));
    else
      (*half)[i].z += 0.1f;
  reg.setInputSource(half);
  reg.setIndices(indices);
  align();
  EXPECT_EQ(out.size(), indices->size());
  EXPECT_LT((reg.getFinalTransformation() - truth.matrix().cast<float>()).norm(), 3e-3);
  EXPECT_LE(reg.getResult().inliers, indices->size());
}

TEST_F(RegistrationProtocol, MaximumIterationsLimitTheLoop)
{
  for (const int limit : {1, 3}) {
    reg.setMaximumIterations(limit);
    align();
    EXPECT_EQ(reg.getResult().iterations, limit);
    EXPECT_EQ(reg.getResult().status, BundleICPStatus::MAX_ITERATIONS);
    EXPECT_TRUE(reg.hasConverged()) << "as in pcl::IterativeClosestPoint";
  }
}

TEST_F(RegistrationProtocol, EpsilonsEndTheLoop)
{
  align();
  const int usual = reg.getResult().iterations;
  reg.setTransformationEpsilon(1); // 1 m
  align();
  EXPECT_LT(reg.getResult().iterations, usual);
  reg.setTransformationEpsilon(1);
  reg.setTransformationRotationEpsilon(1 - 1e-14); // the cosine of an angle near 0
  align();
  EXPECT_GE(reg.getResult().iterations, usual);
  reg.setTransformationEpsilon(1e-20);
  reg.setTransformationRotationEpsilon(0);
  reg.setEuclideanFitnessEpsilon(0.9);
  align();
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::CONVERGED);
}

TEST_F(RegistrationProtocol, MaximumCorrespondenceDistanceIsHonoured)
{
  Eigen::Matrix4f far = truth.matrix().cast<float>();
  far(2, 3) += 0.1f;
  reg.setMaxCorrespondenceDistance(1e-4);
  reg.align(out, far);
  EXPECT_LT(reg.getResult().overlap, 0.01);
  reg.setMaxCorrespondenceDistance(0.5);
  reg.align(out, far);
  EXPECT_GT(reg.getResult().overlap, 0.6);
}

TEST_F(RegistrationProtocol, VisualizationCallbackRunsEachIteration)
{
  int calls = 0;
  std::size_t pairs = 0;
  std::function<void(const Cloud&, const pcl::Indices&, const Cloud&, const pcl::Indices&)>
      callback =
          [&](const Cloud& moved, const pcl::Indices& s, const Cloud& t, const pcl::Indices& q) {
            ++calls;
            ASSERT_EQ(s.size(), q.size());
            pairs = s.size();
            for (std::size_t i = 0; i < s.size(); i += 100) {
              ASSERT_LT(std::size_t(s[i]), moved.size());
              ASSERT_LT(std::size_t(q[i]), t.size());
            }
          };
  ASSERT_TRUE(reg.registerVisualizationCallback(callback)); // PCL calls it once here
  align();
  EXPECT_EQ(calls, reg.getResult().iterations + 1);
  EXPECT_GT(pairs, 1000u);
}

TEST_F(RegistrationProtocol, FitnessScoreUsesATreeOnlyWhenAsked)
{
  // PCL reads the tree through this pointer; a tree of the user's own is used as it is.
  pcl::search::KdTree<Point>::Ptr tree(new pcl::search::KdTree<Point>);
  Cloud::Ptr finite(new Cloud);
  for (const Point& p : *target)
    if (std::isfinite(p.z))
      finite->push_back(p);
  tree->setInputCloud(finite);
  align();
  const double own = reg.getFitnessScore(0.01);
  reg.setSearchMethodTarget(tree, true);
  EXPECT_NEAR(reg.getFitnessScore(0.01), own, 1e-9);
}

TEST_F(RegistrationProtocol, WorksInsideIncrementalRegistration)
{
  pcl::Registration<Point, Point>::Ptr base(new BundleICP<Point, Point>(reg));
  pcl::registration::IncrementalRegistration<Point> incremental;
  incremental.setRegistration(base);
  for (std::size_t i = 3; i < 6; ++i)
    ASSERT_TRUE(incremental.registerCloud(frame(i)));
  EXPECT_LT((incremental.getAbsoluteTransform() - truth.matrix().cast<float>()).norm(), 4e-3);
}
