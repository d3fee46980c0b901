// SPDX-License-Identifier: BSD-3-Clause
#include "frame_pairs.h"

#include <Eigen/Eigenvalues>
#include <pcl/common/transforms.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

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
