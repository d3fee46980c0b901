// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "scan/frames.h"

#include "scan/kept_frames.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/io/memory_dataset.h>
#include <bundle_icp/scan/scan_session.h>

#include <cmath>
#include <limits>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double RATE = 15; ///< of the scan [Hz]

/** A scan at the rate of a slow camera. */
const SyntheticScan&
walk()
{
  static const SyntheticScan scan = [] {
    SyntheticScanOptions options = SyntheticScanOptions::fullNoise();
    options.num_frames = 45;
    options.frame_rate = RATE;
    options.width = 320;
    options.height = 240;
    options.focal_length = 262.5;
    return SyntheticScan(options);
  }();
  return scan;
}

/** Frame of the walk, rendered once. */
RGBDFrame
walkFrame(std::size_t index)
{
  static std::vector<RGBDFrame> rendered(walk().size());
  if (rendered[index].color.empty())
    rendered[index] = walk().read(index);
  return rendered[index];
}

ScanSessionOptions
inStep()
{
  ScanSessionOptions options;
  options.reconstruction.make_mesh = false;
  options.wait_for_mapping = true;
  return options;
}

/** Distance of a pose's position from the truth, in the world of the walk's first frame [m]. */
double
errorOf(const Pose& world_from_camera, std::size_t index)
{
  const Pose truth = walk().worldFromCamera(0).inverse() * walk().worldFromCamera(index);
  return (truth.translation() - world_from_camera.translation()).norm();
}

pcl::PointCloud<pcl::PointXYZRGBA>
cloudOf(const RGBDFrame& frame, const CameraIntrinsics& camera)
{
  pcl::PointCloud<pcl::PointXYZRGBA> cloud(std::uint32_t(frame.depth.cols),
                                           std::uint32_t(frame.depth.rows));
  for (int v = 0; v < frame.depth.rows; ++v)
    for (int u = 0; u < frame.depth.cols; ++u) {
      const float z = frame.depth.at<float>(v, u);
      cloud(u, v).getVector3fMap() = camera.unproject(u, v, z).cast<float>();
      std::copy_n(frame.color.at<cv::Vec3b>(v, u).val, 3, &cloud(u, v).b);
    }
  return cloud;
}

template <class Call>
void
expectBadArgument(const Call& call, const std::string& reason)
{
  EXPECT_CONTAINS(::messageOf<pcl::BadArgumentException>(call), reason);
}

RGBDFrame
blackFrame(double timestamp)
{
  RGBDFrame frame;
  frame.timestamp = timestamp;
  frame.color = cv::Mat::zeros(240, 320, CV_8UC3);
  frame.depth = cv::Mat(240, 320, CV_32FC1, std::numeric_limits<float>::quiet_NaN());
  return frame;
}

} // namespace

TEST(ScanSession, TracksASimulatedScanWithinMillimetres)
{
  ScanSession session(walk().camera(), inStep());
  std::size_t key_frames = 0;
  for (std::size_t i = 0; i < walk().size(); ++i) {
    const LivePose pose = session.addFrame(walkFrame(i));
    EXPECT_EQ(pose.frame, i);
    EXPECT_EQ(pose.timestamp, walk().timestamp(i));
    ASSERT_EQ(pose.status, LiveStatus::GOOD) << i << ": " << pose.reason;
    EXPECT_LT(errorOf(pose.world_from_camera, i), 0.01) << i;
    EXPECT_LT(pose.position_deviation, 0.03) << i;
    key_frames += pose.is_key_frame;
  }
  const LiveModel model = session.model();
  EXPECT_EQ(model.frames, walk().size());
  EXPECT_EQ(model.key_frames + model.waiting, key_frames);
  EXPECT_GT(model.key_frames, 1u);
  EXPECT_LT(model.key_frames, walk().size() / 2);
  EXPECT_GT(model.edges, 0u);
  EXPECT_GT(model.points->size(), 100u);
  const Trajectory trajectory = session.trajectory();
  ASSERT_EQ(trajectory.size(), walk().size());
  for (std::size_t i = 0; i < trajectory.size(); ++i)
    EXPECT_LT(errorOf(trajectory[i].world_from_camera, i), 0.01) << i;
}

TEST(ScanSession, GivesTheSameWithAnyNumberOfThreads)
{
  std::vector<LivePose> poses;
  for (const int threads : {1, 2}) {
    ScanSessionOptions options = inStep();
    options.reconstruction.num_threads = threads;
    ScanSession session(walk().camera(), options);
    for (std::size_t i = 0; i < 15; ++i)
      poses.push_back(session.addFrame(walkFrame(i)));
  }
  for (std::size_t i = 0; i < 15; ++i)
    EXPECT_EQ(poses[i].world_from_camera.matrix(), poses[15 + i].world_from_camera.matrix()) << i;
}

TEST(ScanSession, FindsItsWayBackAfterTwoSecondsOfBlackness)
{
  ScanSession session(walk().camera(), inStep());
  constexpr std::size_t TURN = 25;
  double time = 0;
  const auto add = [&](RGBDFrame frame) {
    frame.timestamp = time += 1 / RATE;
    return session.addFrame(frame);
  };
  for (std::size_t i = 0; i < TURN; ++i)
    add(walkFrame(i));
  for (std::size_t i = 0; i < std::size_t(2 * RATE); ++i) {
    const LivePose pose = add(blackFrame(0));
    EXPECT_EQ(pose.status, LiveStatus::LOST);
    EXPECT_EQ(pose.reason, "hardly any depth was measured");
    EXPECT_TRUE(std::isinf(pose.position_deviation));
  }
  // The camera has turned round meanwhile: it sees the same in the opposite order.
  std::size_t good = 0;
  for (std::size_t k = 0; k < TURN; ++k) {
    const LivePose pose = add(walkFrame(TURN - 1 - k));
    if (pose.status != LiveStatus::GOOD) {
      EXPECT_LT(double(k), RATE) << pose.reason;
      continue;
    }
    ++good;
    EXPECT_LT(errorOf(pose.world_from_camera, TURN - 1 - k), 0.01) << k;
  }
  EXPECT_GE(double(good), double(TURN) - RATE);
}

TEST(ScanSession, FinishGivesWhatReconstructGives)
{
  MemoryDataset dataset(room().camera());
  ScanSessionOptions options = inStep();
  options.reconstruction.make_mesh = true;
  options.reconstruction.volume.voxel_size = 0.02;
  options.reconstruction.volume.truncation = 0.08;
  ScanSession session(room().camera(), options);
  for (std::size_t i = 0; i < 10; ++i) {
    const RGBDFrame frame = room().read(2 * i);
    dataset.add(frame);
    session.addFrame(frame);
  }
  const ReconstructionResult expected = reconstruct(dataset, options.reconstruction);
  const ReconstructionResult result = session.finish();
  EXPECT_EQ(result.status, expected.status);
  EXPECT_EQ(result.component_sizes, expected.component_sizes);
  ASSERT_EQ(result.frames.size(), expected.frames.size());
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    const FrameReport& frame = result.frames[i];
    EXPECT_EQ(frame.name, expected.frames[i].name);
    EXPECT_EQ(frame.timestamp, expected.frames[i].timestamp);
    EXPECT_EQ(frame.features, expected.frames[i].features);
    EXPECT_EQ(frame.verdict, expected.frames[i].verdict);
    EXPECT_EQ(frame.world_from_camera.matrix(), expected.frames[i].world_from_camera.matrix());
  }
  ASSERT_EQ(result.findings.size(), expected.findings.size());
  EXPECT_EQ(result.mesh.cloud.data, expected.mesh.cloud.data);
  EXPECT_FALSE(result.mesh.polygons.empty());
  EXPECT_EQ(result.live_trajectory.size(), 10u);
  EXPECT_TRUE(expected.live_trajectory.empty());
}

TEST(ScanSession, ShowsWhatThereIsInTheMiddleOfAScan)
{
  ScanSessionOptions options = inStep();
  options.reconstruction.volume.voxel_size = 0.02;
  options.reconstruction.volume.truncation = 0.08;
  ScanSession session(walk().camera(), options);
  EXPECT_TRUE(session.cloud()->empty());
  EXPECT_TRUE(session.mesh().polygons.empty());
  EXPECT_TRUE(session.trajectory().empty());
  EXPECT_EQ(session.model().key_frames, 0u);
  for (std::size_t i = 0; i < 10; ++i)
    session.addFrame(walkFrame(i));
  const auto cloud = session.cloud();
  const Pose world_from_start = walk().worldFromCamera(0);
  std::size_t near = 0;
  for (const pcl::PointXYZRGB& point : *cloud)
    near +=
        walk().distanceToSurface(world_from_start * point.getVector3fMap().cast<double>()) < 0.03;
  EXPECT_GT(cloud->size(), 5000u);
  EXPECT_GT(double(near), 0.9 * double(cloud->size()));
  EXPECT_GT(session.mesh().polygons.size(), 1000u);
  EXPECT_EQ(session.addFrame(walkFrame(10)).status, LiveStatus::GOOD);
}

TEST(ScanSession, SuggestsViewsOfWhatNoFrameHasSeen)
{
  ScanSessionOptions options = inStep();
  options.reconstruction.volume.voxel_size = 0.02;
  options.reconstruction.volume.truncation = 0.08;
  ScanSession session(walk().camera(), options);
  EXPECT_TRUE(session.suggestions().empty());
  for (std::size_t i = 0; i < 10; ++i)
    session.addFrame(walkFrame(i));
  const std::vector<NextView> views = session.suggestions();
  ASSERT_FALSE(views.empty());
  const Pose world_from_start = walk().worldFromCamera(0);
  for (const NextView& view : views) {
    EXPECT_GE(view.area, NextViewOptions().min_area);
    for (std::size_t i = 0; i < 10; ++i) {
      const Eigen::Vector3d center =
          walk().worldFromCamera(i).inverse() * (world_from_start * view.center);
      const Eigen::Vector2d pixel = walk().camera().project(center);
      const cv::Mat depth = walkFrame(i).depth;
      const cv::Point nearest(int(std::lround(pixel.x())), int(std::lround(pixel.y())));
      if (center.z() > 0 && cv::Rect({}, depth.size()).contains(nearest)) {
        EXPECT_FALSE(depth.at<float>(nearest) > center.z() + 0.1) << "seen by frame " << i;
      }
    }
  }
  EXPECT_EQ(session.addFrame(walkFrame(10)).status, LiveStatus::GOOD);
}

TEST(ScanSession, TakesOrganizedClouds)
{
  ScanSession session(walk().camera(), inStep()), other(walk().camera(), inStep());
  for (std::size_t i = 0; i < 3; ++i) {
    const RGBDFrame frame = walkFrame(i);
    const LivePose expected = session.addFrame(frame);
    const LivePose pose = other.addFrame(cloudOf(frame, walk().camera()), frame.timestamp);
    EXPECT_EQ(pose.status, LiveStatus::GOOD) << pose.reason;
    EXPECT_EQ(pose.world_from_camera.matrix(), expected.world_from_camera.matrix());
  }
}

TEST(ScanSession, RefusesFramesThatDoNotFit)
{
  ScanSession session(walk().camera(), inStep());
  session.addFrame(walkFrame(1));
  RGBDFrame small = walkFrame(2);
  small.color = small.color(cv::Rect(0, 0, 160, 120)).clone();
  expectBadArgument([&] { session.addFrame(small); },
                    "the colour image has 160 x 120 pixels, the camera 320 x 240");
  RGBDFrame grey = walkFrame(2);
  cv::extractChannel(grey.color, grey.color, 0);
  expectBadArgument([&] { session.addFrame(grey); }, "the colour image is CV_8UC1");
  RGBDFrame empty = walkFrame(2);
  empty.depth.release();
  expectBadArgument([&] { session.addFrame(empty); }, "the depth image is empty");
  expectBadArgument([&] { session.addFrame(walkFrame(0)); }, "is not later than that of the frame");
  expectBadArgument([&] { session.addFrame(walkFrame(1)); }, "is not later than that of the frame");
  RGBDFrame timeless = walkFrame(2);
  timeless.timestamp = std::nan("");
  expectBadArgument([&] { session.addFrame(timeless); }, "the time stamp is not finite");
  pcl::PointCloud<pcl::PointXYZRGBA> cloud = cloudOf(walkFrame(2), walk().camera());
  cloud.width *= cloud.height;
  cloud.height = 1;
  expectBadArgument([&] { session.addFrame(cloud, 1); }, "not organized");
  EXPECT_EQ(session.model().frames, 1u);
  EXPECT_EQ(session.addFrame(walkFrame(2)).status, LiveStatus::GOOD);
}

TEST(ScanSession, EndsOnce)
{
  ScanSession session(walk().camera(), inStep());
  expectBadArgument([&] { session.finish(); }, "no frames");
  expectBadArgument([&] { session.finish(); }, "finish() was called before");
  expectBadArgument([&] { session.addFrame(walkFrame(0)); }, "after finish()");
  EXPECT_TRUE(session.trajectory().empty());
}

TEST(ScanSession, RefusesOptionsOutOfRange)
{
  std::string error;
  EXPECT_TRUE(ScanSessionOptions().isValid(&error)) << error;
  const auto refuses = [](const auto& change, const std::string& reason) {
    ScanSessionOptions options;
    change(options);
    expectBadArgument([&] { ScanSession session(walk().camera(), options); }, reason);
  };
  refuses([](ScanSessionOptions& o) { o.max_views = 0; }, "max_views");
  refuses([](ScanSessionOptions& o) { o.max_views = 21; }, "max_views");
  refuses([](ScanSessionOptions& o) { o.cloud_spacing = 0; }, "cloud_spacing");
  refuses([](ScanSessionOptions& o) { o.cloud_spacing = std::nan(""); }, "cloud_spacing");
  refuses([](ScanSessionOptions& o) { o.reconstruction.depth_reduction = 0; }, "depth_reduction");
  refuses([](ScanSessionOptions& o) { o.reconstruction.moving = MovingPart::OBJECT; }, "object");
  refuses([](ScanSessionOptions& o) { o.reconstruction.poses.emplace(); }, "finds its poses");
  refuses([](ScanSessionOptions& o) { o.reconstruction.method = ReconstructionMethod::RGBD_SFM; },
          "rgbd_sfm");
  CameraIntrinsics distorted = walk().camera();
  distorted.k1 = 0.1;
  expectBadArgument([&] { ScanSession session(distorted); }, "distortion");
}

TEST(KeptFrames, LoseNothing)
{
  const RGBDFrame exact = walkFrame(0);
  for (const float unit : {0.f, 1000.f, 5000.f}) {
    RGBDFrame frame{0, 1, exact.color.clone(), exact.depth.clone()};
    if (unit > 0)
      for (float& z : cv::Mat_<float>(frame.depth))
        z = std::round(z * unit) / unit;
    const PackedDepth packed = packDepth(frame.depth);
    EXPECT_EQ(packed.unit.has_value(), unit > 0) << unit;
    KeptFrames kept(walk().camera());
    kept.add(frame);
    for (int reads = 0; reads < 3; ++reads) {
      const RGBDFrame read = kept.read(0);
      EXPECT_EQ(cv::norm(read.color, frame.color, cv::NORM_INF), 0);
      EXPECT_EQ(cv::countNonZero(read.depth == frame.depth),
                cv::countNonZero(frame.depth == frame.depth));
      EXPECT_EQ(cv::countNonZero(read.depth > 0), cv::countNonZero(frame.depth > 0));
      const cv::Mat unpacked = unpackDepth(packed, frame.depth.size());
      EXPECT_EQ(cv::countNonZero(read.depth == unpacked), cv::countNonZero(frame.depth > 0));
    }
  }
}
