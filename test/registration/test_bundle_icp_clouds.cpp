// SPDX-License-Identifier: BSD-3-Clause
// Clouds of all kinds: with and without camera, grid or normals, made and recorded.
#include "frame_pairs.h"

#include <bundle_icp/io/rgbd_dataset.h>

#include <pcl/common/transforms.h>

#include <fstream>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A small box-shaped room's corner as an unorganized cloud without normals. */
template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr
cornerCloud(float scale = 1)
{
  typename pcl::PointCloud<PointT>::Ptr cloud(new pcl::PointCloud<PointT>);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int i = 0; i < 3000; ++i) {
    Eigen::Vector3f p(uniform(random), uniform(random), uniform(random));
    p[i % 3] = 0;
    PointT point;
    point.getVector3fMap() = scale * p;
    cloud->push_back(point);
  }
  return cloud;
}

} // namespace

TEST(BundleICP, HasConvergedOnlyWhereTheCloudsMeet)
{
  // Without a camera, from where only planes that go on for ever would meet
  Cloud::Ptr source(new Cloud), target(new Cloud);
  for (std::size_t i = 0; i < pair().source->size(); i += 37) {
    if (pcl::isFinite((*pair().source)[i]))
      source->push_back((*pair().source)[i]);
    if (pcl::isFinite((*pair().target)[i]))
      target->push_back((*pair().target)[i]);
  }
  Registration reg;
  reg.setInputSource(source);
  reg.setInputTarget(target);
  Cloud out;
  for (const double distance : {0.0, 10.0, 50.0}) {
    Pose guess = pair().truth;
    guess.translation() += distance * Eigen::Vector3d(0.6, -0.64, 0.48);
    reg.align(out, guess.matrix().cast<float>());
    const bool right = (pair().truth.inverse() * poseOf(reg)).translation().norm() < 0.05;
    EXPECT_EQ(reg.hasConverged(), right) << distance << " m";
    EXPECT_TRUE(right || distance > 0);
  }

  // In millimetres with a camera, whose clouds are metres
  Cloud::Ptr thousandfold[2];
  for (int k = 0; k < 2; ++k) {
    thousandfold[k].reset(new Cloud(k ? *pair().target : *pair().source));
    for (Point& point : *thousandfold[k])
      point.getVector3fMap() *= 1000;
  }
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(thousandfold[0]);
  reg.setInputTarget(thousandfold[1]);
  reg.align(out, Eigen::Matrix4f::Identity());
  EXPECT_FALSE(reg.hasConverged());
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::NO_OVERLAP);
}

TEST(BundleICP, HasNotConvergedOnAHandfulOfPoints)
{
  const auto cloud = cornerCloud<pcl::PointXYZ>();
  for (const std::size_t count : {1, 2, 3}) {
    pcl::PointCloud<pcl::PointXYZ>::Ptr few(new pcl::PointCloud<pcl::PointXYZ>);
    few->assign(cloud->begin(), cloud->begin() + std::ptrdiff_t(count));
    for (const bool is_target : {true, false}) {
      BundleICP<pcl::PointXYZ, pcl::PointXYZ> reg;
      reg.setInputSource(is_target ? cloud : few);
      reg.setInputTarget(is_target ? few : cloud);
      pcl::PointCloud<pcl::PointXYZ> out;
      reg.align(out);
      EXPECT_FALSE(reg.hasConverged()) << count << " points, " << toString(reg.getResult().status);
    }
  }
}

TEST(BundleICP, OnRealFramesIsRightOrHasNotConverged)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  int pairs = 0;
  for (const char* name : {"freiburg1_xyz_10hz", "redkitchen_every4", "replica_walk_a"}) {
    const std::string folder = std::string(BUNDLE_ICP_TEST_DATA) + "/" + name;
    if (!std::ifstream(folder + "/depth.txt") && !std::ifstream(folder + "/frame-000000.depth.png"))
      continue;
    const RGBDDataset::Ptr scan = openDataset(folder);
    for (const std::size_t first : {20, 100}) {
      // The truth of a recording is less exact than this: what is found from near by counts.
      Registration reg;
      reg.setCameraIntrinsics(makeDepthView(scan->read(first).depth, scan->camera(), 4).camera);
      reg.setInputTarget(toPointCloud(makeDepthView(scan->read(first).depth, scan->camera(), 4)));
      reg.setInputSource(
          toPointCloud(makeDepthView(scan->read(first + 1).depth, scan->camera(), 4)));
      Cloud out;
      reg.align(out);
      if (!reg.hasConverged())
        continue;
      const Pose near_by = poseOf(reg);
      ++pairs;
      for (const double distance : {0.3, 1.0, 3.0, 10.0})
        for (unsigned seed = 0; seed < 4; ++seed) {
          const Pose guess = near_by * randomMotion(seed, 0.02, distance);
          reg.align(out, guess.matrix().cast<float>());
          if (reg.hasConverged())
            expectPose(poseOf(reg), near_by, 0.03, 1);
        }
    }
  }
  if (pairs == 0)
    GTEST_SKIP() << "no recording in " << BUNDLE_ICP_TEST_DATA;
}

TEST(BundleICP, IsASoundIcpWithoutCameraOrGrid)
{
  const Pose truth = randomMotion(4, 0.1, 0.05);
  const auto target = cornerCloud<pcl::PointXYZ>();
  pcl::PointCloud<pcl::PointXYZ>::Ptr source(new pcl::PointCloud<pcl::PointXYZ>);
  pcl::transformPointCloud(*target, *source, truth.inverse().matrix().cast<float>());
  pcl::Registration<pcl::PointXYZ, pcl::PointXYZ>::Ptr reg(
      new BundleICP<pcl::PointXYZ, pcl::PointXYZ>);
  reg->setInputSource(source);
  reg->setInputTarget(target);
  pcl::PointCloud<pcl::PointXYZ> out;
  reg->align(out);
  ASSERT_TRUE(reg->hasConverged());
  Pose pose;
  pose.matrix() = reg->getFinalTransformation().cast<double>();
  expectPose(pose, truth, 1e-4, 0.01);
  EXPECT_LT(reg->getFitnessScore(), 1e-8);
  EXPECT_LT((out[7].getVector3fMap() - (*target)[7].getVector3fMap()).norm(), 1e-4);
}

TEST(BundleICP, KdTreeModeWorksInAnyUnit)
{
  const Pose truth = randomMotion(4, 0.1, 50);
  const auto target = cornerCloud<pcl::PointXYZ>(1000); // millimetres
  pcl::PointCloud<pcl::PointXYZ>::Ptr source(new pcl::PointCloud<pcl::PointXYZ>);
  pcl::transformPointCloud(*target, *source, truth.inverse().matrix().cast<float>());
  BundleICP<pcl::PointXYZ, pcl::PointXYZ> reg;
  reg.setInputSource(source);
  reg.setInputTarget(target);
  pcl::PointCloud<pcl::PointXYZ> out;
  reg.align(out);
  Pose pose;
  pose.matrix() = reg.getFinalTransformation().cast<double>();
  expectPose(pose, truth, 0.1, 0.01);
}

TEST(BundleICP, VolumesWithoutNormalsAreMatchedPointToPoint)
{
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-1, 1);
  pcl::PointCloud<pcl::PointXYZ>::Ptr target(new pcl::PointCloud<pcl::PointXYZ>),
      source(new pcl::PointCloud<pcl::PointXYZ>);
  for (int i = 0; i < 400; ++i)
    target->push_back(pcl::PointXYZ(uniform(random), uniform(random), uniform(random)));
  const Pose truth = randomMotion(5, 0.03, 0.03);
  pcl::transformPointCloud(*target, *source, truth.inverse().matrix().cast<float>());
  BundleICP<pcl::PointXYZ, pcl::PointXYZ> reg;
  reg.setInputSource(source);
  reg.setInputTarget(target);
  pcl::PointCloud<pcl::PointXYZ> out;
  reg.align(out);
  Pose pose;
  pose.matrix() = reg.getFinalTransformation().cast<double>();
  expectPose(pose, truth, 1e-4, 0.01);
  EXPECT_LE(reg.getResult().inliers, 400u);
}

TEST(BundleICP, OrganizedCloudsWithoutNormalsAreProjective)
{
  pcl::PointCloud<pcl::PointXYZ>::Ptr source(new pcl::PointCloud<pcl::PointXYZ>),
      target(new pcl::PointCloud<pcl::PointXYZ>);
  pcl::copyPointCloud(*pair().source, *source);
  pcl::copyPointCloud(*pair().target, *target);
  BundleICP<pcl::PointXYZ, pcl::PointXYZ> reg;
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(source);
  reg.setInputTarget(target);
  pcl::PointCloud<pcl::PointXYZ> out;
  reg.align(out, perturbed(pair().truth));
  EXPECT_TRUE(reg.getResult().projective);
  Pose pose;
  pose.matrix() = reg.getFinalTransformation().cast<double>();
  expectPose(pose, pair().truth, 0.002, 0.1);
}

TEST(BundleICP, TargetThatWasSeenFromElsewhereFallsBackToTheTree)
{
  const Pose moved = randomMotion(8, 0.5, 1);
  Cloud::Ptr target(new Cloud);
  pcl::transformPointCloudWithNormals(*pair().target, *target, moved.matrix().cast<float>());
  Registration reg;
  setUp(reg, pair());
  reg.setInputTarget(target); // and no setVirtualDepthPose
  Cloud out;
  reg.align(out, perturbed(moved * pair().truth, 1, 0.02, 0.02));
  EXPECT_FALSE(reg.getResult().projective);
  expectPose(poseOf(reg), moved * pair().truth, 0.005, 0.2);
}

TEST(BundleICP, DoublePrecisionCompilesAndAgrees)
{
  BundleICP<Point, Point, double> reg;
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(pair().source);
  reg.setInputTarget(pair().target);
  Cloud out;
  reg.align(out, perturbed(pair().truth).cast<double>().eval());
  Pose pose;
  pose.matrix() = reg.getFinalTransformation();
  expectPose(pose, pair().truth, 0.002, 0.1);
}

TEST(BundleICP, SettersRefuseNonsense)
{
  Registration reg;
  EXPECT_THROW(reg.setCameraIntrinsics(CameraIntrinsics()), pcl::BadArgumentException);
  Pose scaled = Pose::Identity();
  scaled.linear() *= 1.5;
  EXPECT_THROW(reg.setVirtualDepthPose(scaled), pcl::BadArgumentException);
  EXPECT_THROW(reg.setVisualCorrespondences({Eigen::Vector3d::Zero()}, {}, {}),
               pcl::BadArgumentException);
  CameraIntrinsics camera = room().camera();
  camera.depth_noise.constant = -1;
  EXPECT_THROW(reg.setCameraIntrinsics(camera), pcl::BadArgumentException);
  EXPECT_THROW(reg.setNumberOfThreads(-1), pcl::BadArgumentException);
}
