// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/extract_surface.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <random>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double radius = 0.3;

// A wall 1 m in front of a camera at the origin.
const Intersection wall = plane({0, 0, 1}, 1.0);

void
addNoise(RGBDFrame& frame, double sigma, std::mt19937& random)
{
  std::normal_distribution<float> noise(0.0f, float(sigma));
  for (auto z = frame.depth.begin<float>(); z != frame.depth.end<float>(); ++z)
    *z += noise(random);
}

// Deviations [m] of the distance at points that lie within 1 cm of the wall.
std::vector<double>
wallDeviations(const TSDFVolume& volume)
{
  std::vector<double> deviations;
  for (float x = -0.4f; x <= 0.4f; x += 0.0173f)
    for (float y = -0.3f; y <= 0.3f; y += 0.0173f)
      if (const auto distance = volume.distance({x, y, 1.004f}))
        deviations.push_back(*distance + 0.004);
  return deviations;
}

double
rootMeanSquare(const std::vector<double>& values)
{
  double sum = 0;
  for (const double value : values)
    sum += value * value;
  return std::sqrt(sum / double(values.size()));
}

std::string
refusal(const TSDFOptions& options)
{
  return messageOf<pcl::BadArgumentException>([&] { TSDFVolume volume(options); });
}

std::string
refusal(const RGBDFrame& frame, const CameraIntrinsics& camera, const Pose& pose)
{
  TSDFVolume volume(coarseOptions());
  const std::string message =
      messageOf<pcl::BadArgumentException>([&] { volume.integrate(frame, camera, pose); });
  EXPECT_EQ(volume.numBlocks(), 0u);
  return message;
}

} // namespace

TEST(TSDFVolume, SphereIsZeroOnItsSurfaceAndPositiveOutside)
{
  TSDFVolume volume(coarseOptions());
  for (const Pose& pose : posesAllAround(1.0))
    volume.integrate(render(sphere(radius), pose), smallCamera(), pose);
  const double half_voxel = volume.options().voxel_size / 2;
  double sum = 0;
  int count = 0;
  for (double a = 0; a < 6.28; a += 0.2)
    for (double b = -1.5; b < 1.5; b += 0.2) {
      const Eigen::Vector3d direction(std::cos(a) * std::cos(b), std::sin(a) * std::cos(b),
                                      std::sin(b));
      const auto on = volume.distance((radius * direction).cast<float>());
      const auto outside = volume.distance(((radius + 0.02) * direction).cast<float>());
      const auto inside = volume.distance(((radius - 0.01) * direction).cast<float>());
      ASSERT_TRUE(on && outside && inside);
      EXPECT_LT(std::abs(*on), half_voxel);
      EXPECT_GT(*outside, 0.01);
      EXPECT_LT(*inside, 0);
      sum += std::abs(*on);
      ++count;
    }
  EXPECT_LT(sum / count, half_voxel / 10);
}

TEST(TSDFVolume, DoesNotDependOnTheNumberOfThreads)
{
  TSDFOptions options = coarseOptions();
  std::vector<SurfaceMesh> meshes;
  for (const int threads : {1, 2, 5}) {
    options.num_threads = threads;
    TSDFVolume volume(options);
    for (const Pose& pose : posesAllAround(0.8))
      volume.integrate(render(sphere(radius), pose), smallCamera(), pose);
    MeshOptions mesh_options;
    mesh_options.num_threads = threads;
    meshes.push_back(extractSurface(volume, mesh_options));
  }
  ASSERT_GT(meshes[0].vertices.size(), 1000u);
  for (const SurfaceMesh& mesh : meshes) {
    EXPECT_TRUE(mesh.vertices == meshes[0].vertices);
    EXPECT_TRUE(mesh.normals == meshes[0].normals);
    EXPECT_TRUE(mesh.colors == meshes[0].colors);
    EXPECT_TRUE(mesh.triangles == meshes[0].triangles);
  }
}

TEST(TSDFVolume, OrderOfFramesMattersOnlyByRounding)
{
  // Noisy views of a wall, so that the frames disagree. (Where an outline is seen the
  // order matters more: free space is carved only out of blocks that exist by then.)
  std::mt19937 random(5);
  std::vector<Pose> poses;
  std::vector<RGBDFrame> frames;
  for (const double x : {-0.3, -0.15, 0.0, 0.15, 0.3}) {
    poses.push_back(lookAt({x, 0.1, 0}, {0, 0, 1}));
    frames.push_back(render(wall, poses.back()));
    addNoise(frames.back(), 0.002, random);
  }
  TSDFVolume forward(coarseOptions()), backward(coarseOptions());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t j = frames.size() - 1 - i;
    forward.integrate(frames[i], smallCamera(), poses[i]);
    backward.integrate(frames[j], smallCamera(), poses[j]);
  }
  EXPECT_EQ(forward.numBlocks(), backward.numBlocks());
  std::vector<double> differences;
  for (float x = -0.4f; x <= 0.4f; x += 0.0173f)
    for (float y = -0.3f; y <= 0.3f; y += 0.0173f) {
      const auto a = forward.distance({x, y, 1.002f}), b = backward.distance({x, y, 1.002f});
      ASSERT_TRUE(a && b);
      differences.push_back(*a - *b);
      // A frame's share is off by the 2048th part to which weights are kept.
      EXPECT_NEAR(*a, *b, 0.002 * forward.options().voxel_size);
    }
  EXPECT_LT(rootMeanSquare(differences), 0.0005 * forward.options().voxel_size);
}

TEST(TSDFVolume, NoiseAveragesDown)
{
  const RGBDFrame exact = render(wall, Pose::Identity());
  const double sigma = 0.006;
  std::mt19937 random(7);
  TSDFVolume volume(coarseOptions());
  std::vector<double> errors;
  for (int i = 1; i <= 64; ++i) {
    RGBDFrame frame = exact;
    frame.depth = exact.depth.clone();
    addNoise(frame, sigma, random);
    volume.integrate(frame, smallCamera(), Pose::Identity());
    if (i == 4 || i == 64)
      errors.push_back(rootMeanSquare(wallDeviations(volume)));
  }
  // 16 times the frames, a quarter of the error.
  EXPECT_LT(errors[0], sigma / 2);
  EXPECT_NEAR(errors[1] / errors[0], 0.25, 0.06);
}

TEST(TSDFVolume, ManyFramesDoNotStall)
{
  // After a thousand frames of one depth, frames of another must still pull with their
  // full share, although each moves the mean by far less than the last digit.
  CameraIntrinsics camera = smallCamera();
  camera.width = 40;
  camera.height = 30;
  camera.cx = 19.5;
  camera.cy = 14.5;
  RGBDFrame first, second;
  first.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(1.0));
  second.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(1.0005));
  first.color = cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar(50, 100, 150));
  second.color = cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar(60, 110, 160));
  TSDFVolume volume(coarseOptions());
  for (int i = 0; i < 1000; ++i)
    volume.integrate(first, camera, Pose::Identity());
  const float before = *volume.distance({0, 0, 1.0f});
  for (int i = 0; i < 1000; ++i)
    volume.integrate(second, camera, Pose::Identity());
  EXPECT_NEAR(before, 0, 1e-5);
  EXPECT_NEAR(*volume.distance({0, 0, 1.0f}), 0.00025, 0.00003);

  MeshOptions mesh_options;
  mesh_options.cleaning.min_component_area = 0;
  const SurfaceMesh mesh = extractSurface(volume, mesh_options);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& color : mesh.colors)
    mean += Eigen::Vector3d(color[0], color[1], color[2]) / double(mesh.colors.size());
  EXPECT_LT((mean - Eigen::Vector3d(155, 105, 55)).cwiseAbs().maxCoeff(), 2);
}

TEST(TSDFVolume, FreeSpaceRemovesWhatOneFrameSawByMistake)
{
  const RGBDFrame good = render(wall, Pose::Identity());
  RGBDFrame bad = good;
  bad.depth = good.depth.clone();
  bad.depth(cv::Rect(150, 110, 20, 20)).setTo(0.7f);
  TSDFVolume volume(coarseOptions());
  const auto numNearVertices = [&volume] {
    MeshOptions options;
    options.cleaning.min_component_area = 0;
    const SurfaceMesh mesh = extractSurface(volume, options);
    return std::count_if(mesh.vertices.begin(), mesh.vertices.end(),
                         [](const Eigen::Vector3f& vertex) { return vertex.z() < 0.9f; });
  };
  volume.integrate(bad, smallCamera(), Pose::Identity());
  EXPECT_GT(numNearVertices(), 10);
  for (int i = 0; i < 6; ++i)
    volume.integrate(good, smallCamera(), Pose::Identity());
  EXPECT_EQ(numNearVertices(), 0);
}

TEST(TSDFVolume, RegionLimitsAllocation)
{
  TSDFOptions options = coarseOptions();
  options.region =
      Eigen::AlignedBox3d(Eigen::Vector3d(0.05, -0.1, 0.5), Eigen::Vector3d(0.3, 0.1, 1.5));
  TSDFVolume all(coarseOptions()), part(options);
  const RGBDFrame frame = render(wall, Pose::Identity());
  all.integrate(frame, smallCamera(), Pose::Identity());
  part.integrate(frame, smallCamera(), Pose::Identity());
  EXPECT_LT(part.numBlocks(), all.numBlocks() / 4);
  EXPECT_LT(part.memoryBytes(), all.memoryBytes());
  EXPECT_TRUE(part.distance({0.1f, 0, 1}).has_value());
  EXPECT_FALSE(part.distance({-0.1f, 0, 1}).has_value());
  // Inside, the region changes nothing.
  EXPECT_EQ(part.distance({0.2f, 0.02f, 1.01f}), all.distance({0.2f, 0.02f, 1.01f}));
}

TEST(TSDFVolume, ThinThingsAreAllocatedWhereverTheyAreSeen)
{
  // A bar narrower than half a block in front of a wall farther behind it than the truncation.
  for (int left = 150; left < 158; ++left) {
    RGBDFrame frame = render(wall, Pose::Identity());
    frame.depth(cv::Rect(left, 0, 7, smallCamera().height)).setTo(0.8f);
    TSDFVolume volume(coarseOptions());
    volume.integrate(frame, smallCamera(), Pose::Identity());
    const double x = 0.8 * (left + 3 - smallCamera().cx) / smallCamera().fx;
    const auto distance = volume.distance(Eigen::Vector3d(x, 0, 0.79).cast<float>());
    ASSERT_TRUE(distance.has_value()) << "columns from " << left;
    EXPECT_NEAR(*distance, 0.01, 0.005) << "columns from " << left;
  }
}

TEST(TSDFVolume, DepthOutOfRangeIsIgnored)
{
  TSDFOptions options = coarseOptions();
  options.max_depth = 0.9;
  TSDFVolume volume(options);
  volume.integrate(render(wall, Pose::Identity()), smallCamera(), Pose::Identity());
  EXPECT_EQ(volume.numBlocks(), 0u);
  RGBDFrame frame = render(wall, Pose::Identity());
  for (const float value : {0.0f, -1.0f, NAN, INFINITY}) {
    frame.depth.setTo(value);
    volume.integrate(frame, smallCamera(), Pose::Identity());
    EXPECT_EQ(volume.numBlocks(), 0u) << value;
  }
}

TEST(TSDFVolume, DistanceIsUnsetWhereNothingWasSeen)
{
  TSDFVolume volume(coarseOptions());
  volume.integrate(render(wall, Pose::Identity()), smallCamera(), Pose::Identity());
  EXPECT_TRUE(volume.distance({0, 0, 1}).has_value());
  EXPECT_FALSE(volume.distance({0, 0, 2}).has_value());
  EXPECT_FALSE(volume.distance({NAN, 0, 1}).has_value());
  EXPECT_FALSE(volume.distance({1e30f, 0, 1}).has_value());
}

TEST(TSDFVolume, WorksWithoutColorAndFarFromTheOrigin)
{
  const Pose pose(Eigen::Translation3d(-3000, 2000, 1000) *
                  Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  RGBDFrame frame = render(wall, Pose::Identity());
  frame.color.release();
  TSDFVolume volume(coarseOptions());
  volume.integrate(frame, smallCamera(), pose);
  const auto distance = volume.distance((pose * Eigen::Vector3d(0, 0, 1)).cast<float>());
  ASSERT_TRUE(distance.has_value());
  EXPECT_NEAR(*distance, 0, 0.001);
}

TEST(TSDFVolume, RefusesBadOptions)
{
  TSDFOptions options;
  options.voxel_size = 0;
  EXPECT_CONTAINS(refusal(options), "voxel_size 0 m");
  options = {};
  options.voxel_size = NAN;
  EXPECT_CONTAINS(refusal(options), "voxel_size");
  options = {};
  options.truncation = 0.009;
  EXPECT_CONTAINS(refusal(options), "truncation 0.009 m; expected 2 to 100 voxels of 0.005 m");
  options = {};
  options.min_depth = 6;
  EXPECT_CONTAINS(refusal(options), "depth range 6 to 5 m");
  options = {};
  options.region = Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 1, 0));
  EXPECT_CONTAINS(refusal(options), "region");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(refusal(options), "num_threads -1");
  options = {};
  options.smoothing_radius = 11;
  EXPECT_CONTAINS(refusal(options), "smoothing_radius 11 px; expected 0 to 10");
}

TEST(TSDFVolume, RefusesBadFrames)
{
  const CameraIntrinsics camera = smallCamera();
  const Pose pose = Pose::Identity();
  const RGBDFrame good = render(wall, pose);

  RGBDFrame frame = good;
  frame.depth = cv::Mat(100, 200, CV_32FC1, cv::Scalar(1));
  EXPECT_CONTAINS(refusal(frame, camera, pose),
                  "depth image is 200x100, the camera's images are 320x240");
  frame.depth = cv::Mat(240, 320, CV_16UC1, cv::Scalar(1));
  EXPECT_CONTAINS(refusal(frame, camera, pose), "depth image must be CV_32FC1");
  frame = good;
  frame.color = cv::Mat(10, 10, CV_8UC3);
  EXPECT_CONTAINS(refusal(frame, camera, pose), "color image is 10x10");
  frame.color = cv::Mat(240, 320, CV_8UC1);
  EXPECT_CONTAINS(refusal(frame, camera, pose), "color image must be CV_8UC3");

  CameraIntrinsics wrong = camera;
  wrong.fx = -1;
  EXPECT_CONTAINS(refusal(good, wrong, pose), "focal length");
  wrong = camera;
  wrong.k1 = 0.1;
  EXPECT_CONTAINS(refusal(good, wrong, pose), "distortion");

  wrong = camera;
  wrong.width = wrong.height = 15;
  wrong.cx = wrong.cy = 7;
  wrong.fx = wrong.fy = 20;
  EXPECT_CONTAINS(refusal(good, wrong, pose), "images of 15x15 are smaller than 16x16");

  Pose bad = pose;
  bad.linear() *= 1.2;
  EXPECT_CONTAINS(refusal(good, camera, bad), "not a rigid motion");
  bad = pose;
  bad.translation().x() = NAN;
  EXPECT_CONTAINS(refusal(good, camera, bad), "not a rigid motion");
  bad.translation().x() = 1e6;
  EXPECT_CONTAINS(refusal(good, camera, bad), "from the origin");
}
