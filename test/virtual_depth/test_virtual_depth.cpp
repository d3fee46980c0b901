// SPDX-License-Identifier: BSD-3-Clause
#include "registration/scenes.h"
#include "virtual_depth/depth_errors.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <algorithm>
#include <functional>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

double
rms(const std::vector<float>& errors, double share)
{
  const std::size_t n = std::size_t(share * double(errors.size()));
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i)
    sum += errors[i] * errors[i];
  return std::sqrt(sum / double(n));
}

bool
sameBits(const cv::Mat& a, const cv::Mat& b)
{
  return a.size() == b.size() && a.type() == b.type() &&
         std::equal(a.data, a.data + a.total() * a.elemSize(), b.data);
}

void
expectThrowWith(const std::function<void()>& call, const std::string& part)
{
  try {
    call();
    ADD_FAILURE() << "nothing thrown; expected: " << part;
  }
  catch (const pcl::BadArgumentException& e) {
    EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
  }
}

} // namespace

TEST(VirtualDepth, IdentityWarpReproducesTheDepth)
{
  const cv::Mat depth = room().render(room().worldFromCamera(3)).depth;
  const DepthView view = makeDepthView(depth, room().camera());
  const Pose pose = room().worldFromCamera(3);
  const VirtualDepth out = renderVirtualDepth({{&view, pose}}, room().camera(), pose);
  const std::vector<float> errors = absoluteErrors(out.depth, depth);
  EXPECT_GT(errors.size(), depth.total() * 98 / 100);
  EXPECT_LT(errors[errors.size() * 999 / 1000], 1e-4);
}

TEST(VirtualDepth, IsWithoutBiasOnExactDepth)
{
  std::vector<DepthView> views;
  std::vector<RegisteredView> registered;
  for (std::size_t i = 0; i < 8; ++i)
    views.push_back(makeDepthView(room().readExact(3 * i).depth, room().camera()));
  for (std::size_t i = 0; i < 8; ++i)
    registered.push_back({&views[i], room().worldFromCamera(3 * i)});
  const Pose pose = room().worldFromCamera(10);
  const VirtualDepth out = renderVirtualDepth(registered, room().camera(), pose);
  const cv::Mat truth = room().render(pose).depth;
  const std::vector<float> errors = absoluteErrors(out.depth, truth);
  EXPECT_GT(errors.size(), truth.total() * 95 / 100);
  EXPECT_LT(errors[errors.size() / 2], 0.0003f);
  // Nothing bleeds over occlusion edges: hardly a pixel shows the wrong surface.
  const auto wrong = std::count_if(errors.begin(), errors.end(), [](float e) { return e > 0.05f; });
  EXPECT_LT(double(wrong) / double(errors.size()), 0.005);
}

TEST(VirtualDepth, ErrorFallsLikeTheRootOfTheNumberOfViews)
{
  const Pose pose = room().worldFromCamera(5);
  const cv::Mat truth = room().render(pose).depth;
  std::vector<DepthView> views;
  for (unsigned i = 0; i < 9; ++i)
    views.push_back(makeDepthView(noisy(truth, i), room().camera()));
  std::vector<RegisteredView> registered;
  for (const DepthView& view : views)
    registered.push_back({&view, pose});
  const double one =
      rms(absoluteErrors(renderVirtualDepth({registered[0]}, room().camera(), pose).depth, truth),
          0.98);
  const double nine =
      rms(absoluteErrors(renderVirtualDepth(registered, room().camera(), pose).depth, truth), 0.98);
  EXPECT_NEAR(one / nine, 3, 0.3);
}

TEST(VirtualDepth, NoiseSeenFromAsideDoesNotPullTheSurface)
{
  // 20 degrees to the side at 2.5 m, noise moves samples by more than their spacing.
  const CameraIntrinsics camera = smallCamera(320, 240, 262.5);
  const double z = 2.5;
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitY()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(0, 0, z) - pose.linear() * Eigen::Vector3d(0, 0, z);
  const Eigen::Vector3d normal = pose.linear().transpose() * Eigen::Vector3d::UnitZ();
  const double distance = z - pose.translation().z();
  const DepthView view = makeDepthView(noisy(planeDepth(camera, normal, distance), 7), camera);
  const VirtualDepth out = renderVirtualDepth({{&view, pose}}, camera, Pose::Identity());
  double sum = 0, count = 0;
  for (int v = 60; v < 180; ++v)
    for (int u = 80; u < 240; ++u)
      if (out.depth.at<float>(v, u) > 0) {
        sum += out.depth.at<float>(v, u) - z;
        ++count;
      }
  EXPECT_GT(count, 120 * 160 * 0.9); // folds that face away leave gaps
  EXPECT_LT(std::abs(sum / count), 0.1 * DepthNoise().sigma(z));
}

TEST(VirtualDepth, NearestSurfaceHidesWhatIsBehind)
{
  const CameraIntrinsics camera = smallCamera();
  const cv::Mat front = planeDepth(camera, {0, 0, 1}, 1), back = planeDepth(camera, {0, 0, 1}, 2);
  const DepthView a = makeDepthView(front, camera), b = makeDepthView(back, camera);
  const VirtualDepth out = renderVirtualDepth({{&b, Pose::Identity()}, {&a, Pose::Identity()}},
                                              camera, Pose::Identity());
  EXPECT_FLOAT_EQ(out.depth.at<float>(60, 80), 1);
}

TEST(VirtualDepth, SurfacesSeenFromBehindAreNotRendered)
{
  const CameraIntrinsics camera = smallCamera();
  const DepthView view = makeDepthView(planeDepth(camera, {0, 0, 1}, 1), camera);
  Pose pose = Pose::Identity(); // looks back at the virtual camera, 2 m in front of it
  pose.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()).toRotationMatrix();
  pose.translation().z() = 2;
  const VirtualDepth out = renderVirtualDepth({{&view, pose}}, camera, Pose::Identity());
  EXPECT_TRUE(absoluteErrors(out.depth, cv::Mat(out.depth.size(), CV_32F, cv::Scalar(1))).empty());
}

TEST(VirtualDepth, VarianceIsThatOfTheAverage)
{
  const CameraIntrinsics camera = smallCamera();
  const DepthView view = makeDepthView(planeDepth(camera, {0, 0, 1}, 1.5), camera);
  const RegisteredView one{&view, Pose::Identity()};
  const float single =
      renderVirtualDepth({one}, camera, Pose::Identity()).variance.at<float>(60, 80);
  const float four =
      renderVirtualDepth({one, one, one, one}, camera, Pose::Identity()).variance.at<float>(60, 80);
  EXPECT_NEAR(std::sqrt(single) / DepthNoise().sigma(1.5), 1, 0.01);
  EXPECT_NEAR(single / four, 4, 1e-3);
}

TEST(VirtualDepth, DoesNotDependOnThreadsNorOnTheOrderOfViews)
{
  std::vector<DepthView> views;
  std::vector<RegisteredView> registered, reversed;
  for (unsigned i = 0; i < 5; ++i)
    views.push_back(makeDepthView(noisy(room().readExact(2 * i).depth, i), room().camera()));
  for (std::size_t i = 0; i < 5; ++i)
    registered.push_back({&views[i], room().worldFromCamera(2 * i)});
  reversed.assign(registered.rbegin(), registered.rend());
  const Pose pose = room().worldFromCamera(4);
  VirtualDepthOptions options;
  options.num_threads = 1;
  const VirtualDepth one = renderVirtualDepth(registered, room().camera(), pose, options);
  options.num_threads = 2;
  const VirtualDepth two = renderVirtualDepth(registered, room().camera(), pose, options);
  EXPECT_TRUE(sameBits(one.depth, two.depth));
  EXPECT_TRUE(sameBits(one.normals, two.normals));
  EXPECT_TRUE(sameBits(one.variance, two.variance));
  const VirtualDepth other = renderVirtualDepth(reversed, room().camera(), pose, options);
  const std::vector<float> difference = absoluteErrors(other.depth, one.depth);
  EXPECT_LT(difference.back(), 1e-5);
  const DepthView serial = makeDepthView(room().readExact(0).depth, room().camera(), 2, [] {
    VirtualDepthOptions o;
    o.num_threads = 1;
    return o;
  }());
  const DepthView parallel = makeDepthView(room().readExact(0).depth, room().camera(), 2, [] {
    VirtualDepthOptions o;
    o.num_threads = 2;
    return o;
  }());
  EXPECT_TRUE(sameBits(serial.normals, parallel.normals));
  EXPECT_TRUE(sameBits(serial.weight, parallel.weight));
}

TEST(VirtualDepth, DoesNotDependOnTheWorldFrame)
{
  const DepthView view = makeDepthView(room().readExact(0).depth, room().camera());
  const Pose a = room().worldFromCamera(0), b = room().worldFromCamera(2);
  const Pose moved = randomMotion(3, 2.0, 50);
  const VirtualDepth here = renderVirtualDepth({{&view, a}}, room().camera(), b);
  const VirtualDepth there = renderVirtualDepth({{&view, moved * a}}, room().camera(), moved * b);
  const std::vector<float> difference = absoluteErrors(here.depth, there.depth);
  EXPECT_LT(difference[difference.size() * 999 / 1000], 1e-4);
}

TEST(VirtualDepth, CloudIsOrganizedInTheWorldFrame)
{
  const Pose pose = room().worldFromCamera(1);
  const DepthView view = makeDepthView(room().readExact(1).depth, room().camera());
  const VirtualDepth out = renderVirtualDepth({{&view, pose}}, room().camera(), pose);
  const auto cloud = toPointCloud(out);
  ASSERT_EQ(cloud->width, 320u);
  ASSERT_EQ(cloud->height, 240u);
  const pcl::PointXYZRGBNormal& p = cloud->at(100, 50);
  const float z = out.depth.at<float>(50, 100);
  const Eigen::Vector3d expected = pose * room().camera().unproject(100, 50, z);
  EXPECT_LT((p.getVector3fMap().cast<double>() - expected).norm(), 1e-5);
  EXPECT_NEAR(p.curvature, std::sqrt(out.variance.at<float>(50, 100)), 1e-7);
  EXPECT_LT(room().distanceToSurface(p.getVector3fMap().cast<double>()), 1e-3);
}

TEST(VirtualDepth, RefusesBadInputNamingIt)
{
  const CameraIntrinsics camera = smallCamera();
  const cv::Mat depth(120, 160, CV_32F, cv::Scalar(1));
  expectThrowWith([&] { makeDepthView(cv::Mat(120, 160, CV_16U), camera); }, "CV_32FC1");
  expectThrowWith([&] { makeDepthView(cv::Mat(10, 10, CV_32F), camera); }, "10x10");
  expectThrowWith([&] { makeDepthView(depth, camera, 0); }, "reduction 0");
  expectThrowWith([&] { makeDepthView(depth, CameraIntrinsics()); }, "impossible camera");
  expectThrowWith(
      [&] {
        renderVirtualDepth({{nullptr, Pose::Identity()}}, camera, Pose::Identity());
      },
      "view 0 is a null pointer");
  const DepthView empty, view = makeDepthView(depth, camera);
  expectThrowWith(
      [&] {
        renderVirtualDepth({{&empty, Pose::Identity()}}, camera, Pose::Identity());
      },
      "does not come from makeDepthView");
  Pose scaled = Pose::Identity();
  scaled.linear() *= 2;
  expectThrowWith(
      [&] {
        renderVirtualDepth({{&view, scaled}}, camera, Pose::Identity());
      },
      "not a rigid");
  expectThrowWith([&] { renderVirtualDepth({}, camera, scaled); }, "not a rigid");
}

TEST(VirtualDepth, WithoutViewsShowsNothing)
{
  const VirtualDepth out = renderVirtualDepth({}, smallCamera(), Pose::Identity());
  EXPECT_TRUE(std::isnan(out.depth.at<float>(3, 3)));
  EXPECT_TRUE(std::isnan(toPointCloud(out)->at(3, 3).z));
}

TEST(VirtualDepthOptions, EveryFieldIsChecked)
{
  const std::vector<std::function<void(VirtualDepthOptions&)>> faults = {
      [](auto& o) { o.edge_distance = -1; }, [](auto& o) { o.max_view_angle = 90; },
      [](auto& o) { o.merge_sigmas = std::nan(""); }, [](auto& o) { o.num_threads = -1; }};
  EXPECT_TRUE(VirtualDepthOptions().isValid());
  for (const auto& fault : faults) {
    VirtualDepthOptions options;
    fault(options);
    std::string error;
    EXPECT_FALSE(options.isValid(&error));
    EXPECT_FALSE(error.empty());
    EXPECT_THROW(renderVirtualDepth({}, smallCamera(), Pose::Identity(), options),
                 pcl::BadArgumentException);
  }
}
