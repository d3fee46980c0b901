// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"

#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/registration/bundle_icp.h>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <pcl/common/transforms.h>

#include <fstream>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;
using Registration = BundleICP<Point, Point>;

/** Two frames of the room, the target in its own camera frame. */
struct FramePairData {
  Cloud::Ptr source, target;
  Pose truth; // target from source
};

FramePairData
framePair(std::size_t target, std::size_t source, bool with_noise = false)
{
  const auto cloud = [&](std::size_t i) {
    const cv::Mat exact = room().readExact(i).depth;
    return toPointCloud(
        makeDepthView(with_noise ? noisy(exact, unsigned(i)) : exact, room().camera()));
  };
  return {cloud(source), cloud(target),
          room().worldFromCamera(target).inverse() * room().worldFromCamera(source)};
}

const FramePairData&
pair()
{
  static const FramePairData data = framePair(3, 5);
  return data;
}

Pose
poseOf(Registration& reg)
{
  Pose pose;
  pose.matrix() = reg.getFinalTransformation().cast<double>();
  return pose;
}

Eigen::Matrix4f
perturbed(const Pose& truth, unsigned seed = 1, double angle = 5 * M_PI / 180,
          double distance = 0.05)
{
  return (truth * randomMotion(seed, angle, distance)).matrix().cast<float>();
}

void
setUp(Registration& reg, const FramePairData& data)
{
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(data.source);
  reg.setInputTarget(data.target);
}

void
expectPose(const Pose& actual, const Pose& truth, double metres, double angle)
{
  const Pose error = truth.inverse() * actual;
  EXPECT_LT(error.translation().norm(), metres);
  EXPECT_LT(degrees(rotationAngle(error)), angle);
}

/** How many of the trials come back within the bounds from 5 cm and 5 degrees. */
int
successes(int trials, bool with_noise, double metres, double angle)
{
  int count = 0;
  for (int k = 0; k < trials; ++k) {
    const std::size_t target = std::size_t(k);
    const FramePairData data = framePair(target, target + 1 + target % 3, with_noise);
    Registration reg;
    setUp(reg, data);
    Cloud out;
    reg.align(out, perturbed(data.truth, unsigned(k)));
    const Pose error = data.truth.inverse() * poseOf(reg);
    count += error.translation().norm() < metres && degrees(rotationAngle(error)) < angle;
  }
  return count;
}

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

/** Frame and virtual depth of a plane at 1.5 m, which sliding and turning in it leaves
 * as it is. */
struct PlaneData {
  CameraIntrinsics camera = smallCamera(320, 240, 262.5);
  Cloud::Ptr cloud, noisy_cloud;
  PlaneData()
  {
    const cv::Mat depth = planeDepth(camera, {0, 0, 1}, 1.5);
    cloud = toPointCloud(makeDepthView(depth, camera));
    noisy_cloud = toPointCloud(makeDepthView(noisy(depth, 2), camera));
  }
};

void
addVisualEvidence(Registration& reg, const Pose& world_from_source, double error = 0)
{
  std::vector<Eigen::Vector3d> source, target;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  std::normal_distribution<double> normal(0, error);
  for (int i = 0; i < 80; ++i) {
    source.emplace_back(uniform(random), uniform(random), 1.5);
    target.push_back(world_from_source * source.back() +
                     Eigen::Vector3d(normal(random), normal(random), normal(random)));
  }
  reg.setVisualCorrespondences(source, target, std::vector<double>(80, 1 / (0.005 * 0.005)));
}

} // namespace

TEST(BundleICP, ReturnsFromFiveDegreesOnExactDepth)
{
  EXPECT_GE(successes(40, false, 0.002, 0.1), 38);
}

TEST(BundleICP, ReturnsFromFiveDegreesOnNoisyDepth)
{
  EXPECT_GE(successes(40, true, 0.005, 0.3), 38);
}

TEST(BundleICP, VirtualDepthInTheWorldFrameGivesTheWorldPose)
{
  std::vector<DepthView> views;
  std::vector<RegisteredView> registered;
  for (unsigned i = 0; i < 4; ++i)
    views.push_back(makeDepthView(noisy(room().readExact(i).depth, i), room().camera()));
  for (std::size_t i = 0; i < 4; ++i)
    registered.push_back({&views[i], room().worldFromCamera(i)});
  const Pose truth = room().worldFromCamera(5), start = truth * randomMotion(2, 0.08, 0.05);
  int renderings = 0;
  Registration reg;
  reg.setCameraIntrinsics(room().camera());
  reg.setInputSource(framePair(3, 5, true).source);
  reg.setInputTarget(toPointCloud(renderVirtualDepth(registered, room().camera(), start)));
  reg.setVirtualDepthPose(start);
  reg.setVirtualDepthRenderer([&](const Pose& pose) {
    ++renderings;
    return toPointCloud(renderVirtualDepth(registered, room().camera(), pose));
  });
  Cloud out;
  reg.align(out, start.matrix().cast<float>());
  ASSERT_TRUE(reg.hasConverged());
  EXPECT_TRUE(reg.getResult().projective);
  expectPose(poseOf(reg), truth, 0.004, 0.2);
  EXPECT_GE(renderings, 1) << "the pose moved by more than 2 cm";
  EXPECT_LE(renderings, 4);
  EXPECT_EQ(reg.getResult().renderings, renderings);
  EXPECT_GT(reg.getResult().overlap, 0.6);
}

TEST(BundleICP, DoesNotDependOnThreadsNorOnTheRun)
{
  const auto run = [&](int threads) {
    Registration reg;
    setUp(reg, pair());
    reg.setNumberOfThreads(threads);
    Cloud out;
    reg.align(out, perturbed(pair().truth));
    return std::make_pair(reg.getFinalTransformation(), reg.getResult().information);
  };
  const auto one = run(1), two = run(2), again = run(2);
  EXPECT_EQ(one.first, two.first);
  EXPECT_EQ(one.second, two.second);
  EXPECT_EQ(two.first, again.first);
}

TEST(BundleICP, FollowsTheWorldFrame)
{
  Registration reg;
  setUp(reg, pair());
  Cloud out;
  reg.align(out, perturbed(pair().truth));
  const Pose here = poseOf(reg);
  const Pose moved = randomMotion(8, 1.5, 3);
  Cloud::Ptr target(new Cloud);
  pcl::transformPointCloudWithNormals(*pair().target, *target, moved.matrix().cast<float>());
  reg.setInputTarget(target);
  reg.setVirtualDepthPose(moved);
  reg.align(out, (moved.cast<float>().matrix() * perturbed(pair().truth)).eval());
  expectPose(poseOf(reg), moved * here, 2e-4, 0.01);
}

TEST(BundleICP, PlaneIsReportedAndLeavesTheGuess)
{
  const PlaneData plane;
  Registration reg;
  reg.setCameraIntrinsics(plane.camera);
  reg.setInputSource(plane.noisy_cloud);
  reg.setInputTarget(plane.cloud);
  Pose guess = Pose::Identity();
  guess.translation() = Eigen::Vector3d(0.03, -0.02, 0.04);
  Cloud out;
  reg.align(out, guess.matrix().cast<float>());
  // Two translations in the plane and the rotation about its normal are open.
  ASSERT_EQ(reg.getResult().degenerate_directions.size(), 3u);
  for (const Vector6d& direction : reg.getResult().degenerate_directions) {
    EXPECT_NEAR(direction.norm(), 1, 1e-9);
    EXPECT_NEAR(direction[5], 0, 0.05) << "motion along the normal is held";
  }
  EXPECT_NEAR(poseOf(reg).translation().x(), 0.03, 2e-3);
  EXPECT_NEAR(poseOf(reg).translation().y(), -0.02, 2e-3);
  EXPECT_NEAR(poseOf(reg).translation().z(), 0, 1e-3);
}

TEST(BundleICP, NoiseOfBothNormalsDoesNotPassForStructure)
{
  const PlaneData plane;
  const cv::Mat depth = planeDepth(plane.camera, {0, 0, 1}, 1.5);
  Registration reg;
  reg.setCameraIntrinsics(plane.camera);
  reg.setInputSource(plane.noisy_cloud);
  reg.setInputTarget(toPointCloud(makeDepthView(noisy(depth, 9), plane.camera)));
  Cloud out;
  reg.align(out);
  EXPECT_EQ(reg.getResult().degenerate_directions.size(), 3u);
  // Before the last level such noise may move the pose by its own small share.
  expectPose(poseOf(reg), Pose::Identity(), 0.004, 0.2);
}

TEST(BundleICP, VisualEvidenceHoldsThePoseOnAPlane)
{
  const PlaneData plane;
  Registration reg;
  reg.setCameraIntrinsics(plane.camera);
  reg.setInputSource(plane.noisy_cloud);
  reg.setInputTarget(plane.cloud);
  Pose truth = Pose::Identity();
  truth.linear() = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  truth.translation() = Eigen::Vector3d(0.04, 0.03, 0);
  addVisualEvidence(reg, truth, 0.002);
  Cloud out;
  reg.align(out); // the guess is not even needed
  ASSERT_TRUE(reg.hasConverged());
  EXPECT_TRUE(reg.getResult().visual_initial_pose);
  EXPECT_EQ(reg.getResult().visual_inliers, 80u);
  EXPECT_EQ(reg.getResult().degenerate_directions.size(), 3u);
  expectPose(poseOf(reg), truth, 0.002, 0.1);
}

TEST(BundleICP, RefinementAgainstTheVisualEvidenceIsRejected)
{
  // The surfaces say 8 cm along the axis, beyond what the correspondences allow.
  const PlaneData plane;
  Registration reg;
  reg.setCameraIntrinsics(plane.camera);
  reg.setInputSource(plane.cloud);
  reg.setInputTarget(plane.cloud);
  Pose visual = Pose::Identity();
  visual.translation().z() = 0.08;
  addVisualEvidence(reg, visual, 0.001);
  Cloud out;
  reg.align(out);
  EXPECT_EQ(reg.getResult().status, BundleICPStatus::REFINEMENT_REJECTED);
  EXPECT_FALSE(reg.hasConverged());
  expectPose(poseOf(reg), visual, 0.002, 0.1);
}

TEST(BundleICP, VisualOutliersFallBackToTheGuess)
{
  Registration reg;
  setUp(reg, pair());
  std::vector<Eigen::Vector3d> points, others;
  for (unsigned i = 0; i < 30; ++i) {
    points.push_back(randomMotion(i, 0, 1).translation());
    others.push_back(randomMotion(100 + i, 0, 2).translation());
  }
  reg.setVisualCorrespondences(points, others, std::vector<double>(30, 1e4));
  Cloud out;
  reg.align(out, perturbed(pair().truth));
  EXPECT_FALSE(reg.getResult().visual_initial_pose);
  EXPECT_TRUE(reg.hasConverged());
  expectPose(poseOf(reg), pair().truth, 0.002, 0.1);
}

TEST(BundleICP, InformationIsPositiveAndHonestWithinAnOrderOfMagnitude)
{
  // The spread of results over noise against what the information promises.
  const Pose truth = room().worldFromCamera(3).inverse() * room().worldFromCamera(4);
  const Cloud::Ptr target = framePair(3, 4).target;
  double squared = 0, promised = 0;
  constexpr int RUNS = 8;
  for (unsigned k = 0; k < RUNS; ++k) {
    Registration reg;
    reg.setCameraIntrinsics(room().camera());
    reg.setInputTarget(target);
    reg.setInputSource(
        toPointCloud(makeDepthView(noisy(room().readExact(4).depth, k), room().camera())));
    Cloud out;
    reg.align(out, truth.matrix().cast<float>());
    const Matrix6d information = reg.getResult().information;
    EXPECT_NEAR((information - information.transpose()).norm() / information.norm(), 0, 1e-9);
    const Matrix6d covariance = information.inverse();
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues()[0], 0);
    squared += (poseOf(reg).translation() - truth.translation()).squaredNorm() / RUNS;
    promised += covariance.bottomRightCorner<3, 3>().trace() / RUNS;
  }
  // White noise is better than the correlated noise that the information allows for.
  EXPECT_LT(std::sqrt(squared), 2 * std::sqrt(promised));
  EXPECT_GT(std::sqrt(squared), 0.02 * std::sqrt(promised));
}

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

TEST(BundleICP, OnRealFramesIsRightOrHasNotConverged)
{
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
