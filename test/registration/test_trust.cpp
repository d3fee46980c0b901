// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What BundleICP trusts: where the clouds meet too little or fit elsewhere as well it says so, and
// where its first answer is doubtful it looks around.
#include "frame_pairs.h"

#include <bundle_icp/io/rgbd_dataset.h>

#include <fstream>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using RawCloud = pcl::PointCloud<pcl::PointXYZ>;

/** As a driver gives it: organized, NaN = no depth, no normals. */
RawCloud::Ptr
rawCloud(const cv::Mat& depth, const CameraIntrinsics& camera)
{
  RawCloud::Ptr cloud(new RawCloud(unsigned(depth.cols), unsigned(depth.rows)));
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u)
      (*cloud)(u, v).getVector3fMap() =
          camera.unproject(u, v, double(depth.at<float>(v, u))).cast<float>();
  cloud->is_dense = false;
  return cloud;
}

/** The two walls of a corridor along the camera's axis, without an end. */
cv::Mat
corridorDepth(const CameraIntrinsics& camera)
{
  cv::Mat depth = planeDepth(camera, Eigen::Vector3d::UnitX(), 1);
  cv::Mat left = planeDepth(camera, -Eigen::Vector3d::UnitX(), 1);
  left.copyTo(depth, left > 0);
  depth.setTo(std::numeric_limits<float>::quiet_NaN(), depth > 5);
  return depth;
}

bool
isInfiniteAlong(const BundleICPResult& result, int coordinate)
{
  return std::isinf(result.covariance()(coordinate, coordinate));
}

} // namespace

TEST(BundleICPTrust, WhatSurfacesLeaveOpenIsNotConvergedUnlessTheGuessIsTrusted)
{
  const CameraIntrinsics camera = smallCamera();
  for (const bool is_corridor : {false, true}) {
    const cv::Mat depth =
        is_corridor ? corridorDepth(camera) : planeDepth(camera, Eigen::Vector3d::UnitZ(), 2);
    Registration reg;
    reg.setCameraIntrinsics(camera);
    reg.setInputSource(toPointCloud(makeDepthView(depth, camera)));
    reg.setInputTarget(toPointCloud(makeDepthView(depth, camera)));
    Cloud out;
    reg.align(out);
    EXPECT_EQ(reg.getResult().status, BundleICPStatus::LOW_OVERLAP) << reg.getResult().summary();
    EXPECT_FALSE(reg.hasConverged());
    EXPECT_TRUE(isInfiniteAlong(reg.getResult(), is_corridor ? 5 : 3));
    EXPECT_FALSE(isInfiniteAlong(reg.getResult(), is_corridor ? 3 : 5));
    reg.setMaxMisalignment(0.03);
    reg.align(out);
    EXPECT_EQ(reg.getResult().status, BundleICPStatus::CONVERGED) << reg.getResult().summary();
  }
}

TEST(BundleICPTrust, ASmallPartInCommonIsNotTrusted)
{
  Cloud::Ptr strip(new Cloud(*pair().target));
  for (int v = 0; v < int(strip->height); ++v)
    for (int u = int(strip->width) / 5; u < int(strip->width); ++u)
      (*strip)(u, v).getVector3fMap().setConstant(std::numeric_limits<float>::quiet_NaN());
  Registration reg;
  setUp(reg, pair());
  reg.setInputTarget(strip);
  Cloud out;
  reg.align(out, pair().truth.matrix().cast<float>());
  EXPECT_FALSE(reg.hasConverged()) << reg.getResult().summary();
}

TEST(BundleICPTrust, OneTargetPointIsNoPlaceToMeet)
{
  RawCloud::Ptr target(new RawCloud), source(new RawCloud);
  target->push_back({0, 0, 1});
  for (int i = 0; i < 100; ++i)
    source->push_back({float(i % 10) / 10, float(i / 10) / 10, 1});
  BundleICP<pcl::PointXYZ, pcl::PointXYZ> reg;
  reg.setInputSource(source);
  reg.setInputTarget(target);
  RawCloud out;
  reg.align(out);
  EXPECT_FALSE(reg.hasConverged()) << reg.getResult().summary();
}

TEST(BundleICPTrust, RawFramesUpToASecondApartAreRightOrNotConverged)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  const std::string folder = std::string(BUNDLE_ICP_TEST_DATA) + "/freiburg1_xyz_10hz";
  if (!std::ifstream(folder + "/depth.txt"))
    GTEST_SKIP() << "no " << folder;
  const RGBDDataset::Ptr scan = openDataset(folder);
  const Trajectory truth = scan->groundTruth();
  const auto poseAt = [&](std::size_t frame) {
    const auto later =
        std::lower_bound(truth.begin(), truth.end(), scan->timestamp(frame),
                         [](const TimedPose& pose, double time) { return pose.timestamp < time; });
    return later == truth.end() ? truth.back() : *later;
  };
  int right = 0;
  for (std::size_t first = 0; first < 256; first += 32)
    for (const std::size_t gap : {1, 3, 5, 10}) {
      const TimedPose target = poseAt(first), source = poseAt(first + gap);
      BundleICP<pcl::PointXYZ, pcl::PointXYZ> reg;
      reg.setCameraIntrinsics(scan->camera());
      reg.setInputTarget(rawCloud(scan->read(first).depth, scan->camera()));
      reg.setInputSource(rawCloud(scan->read(first + gap).depth, scan->camera()));
      RawCloud out;
      reg.align(out);
      const Pose error = (target.world_from_camera.inverse() * source.world_from_camera).inverse() *
                         reg.getResult().world_from_source;
      const bool is_right = error.translation().norm() < 0.05;
      right += is_right ? 1 : 0;
      EXPECT_TRUE(is_right || !reg.hasConverged())
          << first << " and " << gap << " on: " << reg.getResult().summary();
    }
  EXPECT_GT(right, 25) << "of 32; 24 without looking around";
}
