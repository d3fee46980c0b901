// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Geometry, path, texture and order of the exact scan.
#include "messages.h"
#include "scans.h"

#include <gtest/gtest.h>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <pcl/exceptions.h>

#include <set>
#include <thread>

using namespace bundle_icp;

TEST(SyntheticScan, DepthLiesOnTheSurface)
{
  SyntheticScanOptions options = smallScan();
  options.frame_rate = 0.1; // all around the table and along the walls
  options.num_frames = 30;
  const SyntheticScan scan(options);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const RGBDFrame frame = scan.read(i);
    ASSERT_EQ(frame.depth.type(), CV_32FC1);
    ASSERT_EQ(frame.color.type(), CV_8UC3);
    ASSERT_EQ(frame.depth.size(), cv::Size(160, 120));
    EXPECT_LT(largestDistance(scan, frame.depth, scan.camera(), scan.worldFromCamera(i)), 1e-5)
        << i;
  }
}

TEST(SyntheticScan, OddImageSizesAreExactToo)
{
  SyntheticScanOptions options = smallScan();
  options.width = 101;
  options.height = 147; // portrait
  options.num_frames = 2;
  const SyntheticScan scan(options);
  const RGBDFrame frame = scan.read(1);
  ASSERT_EQ(frame.color.size(), cv::Size(101, 147));
  EXPECT_LT(largestDistance(scan, frame.depth, scan.camera(), scan.worldFromCamera(1)), 1e-5);
}

TEST(SyntheticScan, NothingHidesWhatIsSeen)
{
  // No surface may lie between the camera and a measured point.
  const SyntheticScan& scan = exactScan();
  const RGBDFrame frame = scan.read(3);
  const Pose pose = scan.worldFromCamera(3);
  for (int y = 0; y < frame.depth.rows; y += 5)
    for (int x = 0; x < frame.depth.cols; x += 5) {
      const Eigen::Vector3d ray = scan.camera().unproject(x, y, 1);
      const double seen = frame.depth.at<float>(y, x) * ray.norm();
      // Sphere tracing: a step as long as the distance cannot pass through a surface.
      double travelled = 0, step = 1;
      while (step > 1e-4 && travelled < seen) {
        step = scan.distanceToSurface(pose * (travelled * ray.normalized()));
        travelled += step;
      }
      EXPECT_GT(travelled, seen - 0.02) << x << " " << y;
    }
}

TEST(SyntheticScan, TwoViewsAgree)
{
  const SyntheticScan& scan = exactScan();
  const RGBDFrame first = scan.read(4), second = scan.read(5);
  const Pose second_from_first = scan.worldFromCamera(5).inverse() * scan.worldFromCamera(4);
  int in_view = 0, same_depth = 0, same_color = 0;
  for (int y = 0; y < first.depth.rows; ++y)
    for (int x = 0; x < first.depth.cols; ++x) {
      const Eigen::Vector3d point =
          second_from_first * scan.camera().unproject(x, y, first.depth.at<float>(y, x));
      const Eigen::Vector2d pixel = scan.camera().project(point);
      if (point.z() <= 0 || !scan.camera().contains(pixel))
        continue;
      const cv::Point there(int(std::lround(pixel.x())), int(std::lround(pixel.y())));
      ++in_view;
      if (std::abs(second.depth.at<float>(there) / point.z() - 1) > 0.03)
        continue;
      ++same_depth;
      const cv::Vec3b a = first.color.at<cv::Vec3b>(y, x), b = second.color.at<cv::Vec3b>(there);
      same_color += std::abs(a[0] + a[1] + a[2] - b[0] - b[1] - b[2]) < 60;
    }
  EXPECT_GT(in_view, 5000);
  EXPECT_GT(same_depth, 0.85 * in_view);    // the rest is hidden by something
  EXPECT_GT(same_color, 0.75 * same_depth); // pixels differ by half a pixel in place
}

TEST(SyntheticScan, DistanceToSurfaceIsThatOfItsPoints)
{
  const SyntheticScan& scan = exactScan();
  const auto surface = scan.visibleSurface(0.05, 1);
  for (std::size_t i = 0; i < surface->size(); i += 211) {
    const pcl::PointNormal& p = (*surface)[i];
    const Eigen::Vector3d point =
        (p.getVector3fMap() + 0.3f * p.getNormalVector3fMap()).cast<double>();
    double nearest = 1e9;
    for (const pcl::PointNormal& q : *surface)
      nearest = std::min(nearest, (q.getVector3fMap().cast<double>() - point).norm());
    const double distance = scan.distanceToSurface(point);
    EXPECT_LE(distance, nearest + 1e-5);
    EXPECT_LE(distance, 0.3 + 1e-5);
    EXPECT_GT(distance, 0);
  }
}

TEST(SyntheticScan, VisibleSurfaceHasOnePointAVoxelOnTheSurface)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 1;
  const SyntheticScan scan(options);
  const auto surface = scan.visibleSurface(0.03, 1);
  ASSERT_GT(surface->size(), 1000u);
  const Eigen::Vector3d camera = scan.worldFromCamera(0).translation();
  std::set<std::array<int, 3>> voxels;
  for (const pcl::PointNormal& p : *surface) {
    const Eigen::Vector3d point = p.getVector3fMap().cast<double>();
    const Eigen::Vector3d normal = p.getNormalVector3fMap().cast<double>();
    EXPECT_LT(scan.distanceToSurface(point), 1e-5);
    EXPECT_NEAR(normal.norm(), 1, 1e-5);
    EXPECT_GT(normal.dot(camera - point), 0); // towards where it was seen from
    EXPECT_LT(scan.distanceToSurface(point + 1e-3 * normal), 1e-3 + 1e-5);
    voxels.insert(
        {int(std::floor(p.x / 0.03)), int(std::floor(p.y / 0.03)), int(std::floor(p.z / 0.03))});
  }
  EXPECT_GE(voxels.size(),
            0.999 * double(surface->size())); // but for rounding at borders
}

TEST(SyntheticScan, VisibleSurfaceDoesNotDependOnThreads)
{
  const auto one = exactScan().visibleSurface(0.02, 1), three = exactScan().visibleSurface(0.02, 3);
  ASSERT_EQ(one->size(), three->size());
  for (std::size_t i = 0; i < one->size(); ++i)
    ASSERT_EQ((*one)[i].getVector3fMap(), (*three)[i].getVector3fMap());
  EXPECT_THROW(exactScan().visibleSurface(0), pcl::BadArgumentException);
  EXPECT_THROW(exactScan().visibleSurface(std::nan("")), pcl::BadArgumentException);
}

TEST(SyntheticScan, TexturesGiveFeatures)
{
  SyntheticScanOptions options;
  options.frame_rate = 1.0 / 7;
  options.num_frames = 26; // three minutes
  const SyntheticScan scan(options);
  const auto sift = cv::SIFT::create(1000);
  int rich = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    cv::Mat gray;
    cv::cvtColor(scan.read(i).color, gray, cv::COLOR_BGR2GRAY);
    std::vector<cv::KeyPoint> keypoints;
    sift->detect(gray, keypoints);
    rich += keypoints.size() >= 500;
    EXPECT_GT(keypoints.size(), 100u) << i;
  }
  EXPECT_GE(rich, 24);
}

TEST(SyntheticScan, MovesLikeAHand)
{
  for (const std::uint64_t seed : {0, 7}) {
    SyntheticScanOptions options = smallScan();
    options.num_frames = 9000;
    options.frame_rate = 30;
    options.seed = seed;
    const SyntheticScan scan(options);
    double speed_sum = 0, turn_sum = 0;
    Eigen::Vector3d last_velocity = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i + 1 < scan.size(); ++i) {
      const Pose a = scan.worldFromCamera(i), b = scan.worldFromCamera(i + 1);
      EXPECT_GT(scan.distanceToSurface(a.translation()), 0.35) << i;
      EXPECT_LT(a.translation().cwiseAbs().maxCoeff(), 2);
      const Eigen::Vector3d velocity = 30 * (b.translation() - a.translation());
      const double turn = 30 * rotationAngle(a.inverse() * b) * 180 / M_PI;
      EXPECT_LT(velocity.norm(), 0.55) << i;
      EXPECT_LT(turn, 75) << i;
      if (i > 0) {
        EXPECT_LT((velocity - last_velocity).norm() * 30, 2) << i; // no jump
      }
      last_velocity = velocity;
      speed_sum += velocity.norm();
      turn_sum += turn;
    }
    EXPECT_GT(speed_sum / double(scan.size()), 0.1);
    EXPECT_LT(speed_sum / double(scan.size()), 0.4);
    EXPECT_GT(turn_sum / double(scan.size()), 10);
    EXPECT_LT(turn_sum / double(scan.size()), 30);
  }
}

TEST(SyntheticScan, LongScanSeesEveryWall)
{
  SyntheticScanOptions options = smallScan();
  options.num_frames = 3000;
  options.frame_rate = 10;
  const SyntheticScan scan(options);
  std::set<int> walls;
  int at_table = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Pose pose = scan.worldFromCamera(i);
    const Eigen::Vector3d gaze = pose.linear().col(2), from = pose.translation();
    // Which of the room's four walls the optical axis would meet first.
    const double to_x = (std::copysign(2.0, gaze.x()) - from.x()) / gaze.x();
    const double to_y = (std::copysign(2.5, gaze.y()) - from.y()) / gaze.y();
    const double nearest = std::min(to_x, to_y);
    if (nearest < 1.5)
      walls.insert(to_x < to_y ? (gaze.x() > 0 ? 0 : 1) : (gaze.y() > 0 ? 2 : 3));
    at_table += (from + (0.76 - from.z()) / gaze.z() * gaze).cwiseAbs().maxCoeff() < 0.8;
  }
  EXPECT_EQ(walls.size(), 4u);
  EXPECT_GT(at_table, 1000);
}

TEST(SyntheticScan, FrameRateSamplesTheSamePath)
{
  SyntheticScanOptions options = smallScan();
  options.frame_rate = 6;
  options.num_frames = 36;
  const SyntheticScan scan(options);
  for (std::size_t i = 0; i < exactScan().size(); ++i)
    EXPECT_TRUE(scan.worldFromCamera(3 * i).isApprox(exactScan().worldFromCamera(i), 1e-12));
  EXPECT_DOUBLE_EQ(scan.timestamp(3), 0.5);
}

TEST(SyntheticScan, StartsWhereAsked)
{
  SyntheticScanOptions options = smallScan();
  options.start_time = 1;
  const SyntheticScan scan(options);
  for (std::size_t i = 0; i + 2 < scan.size(); ++i)
    EXPECT_TRUE(scan.worldFromCamera(i).isApprox(exactScan().worldFromCamera(i + 2), 1e-12));
  EXPECT_EQ(scan.timestamp(0), 0);
}

TEST(SyntheticScan, TurnsOnTheSpot)
{
  SyntheticScanOptions options = smallScan();
  options.start_time = 67;
  options.num_frames = 100;
  options.movement = 0;
  const SyntheticScan scan(options);
  double largest = 0;
  for (std::size_t i = 1; i < scan.size(); ++i) {
    EXPECT_EQ(scan.worldFromCamera(i).translation(), scan.worldFromCamera(0).translation());
    largest = std::max(largest,
                       rotationAngle(scan.worldFromCamera(0).inverse() * scan.worldFromCamera(i)));
  }
  EXPECT_GT(largest, 0.8);
}

TEST(SyntheticScan, WithoutTextureThereAreFewFeatures)
{
  SyntheticScanOptions options;
  options.num_frames = 1;
  const auto count = [&](double texture) {
    options.texture = texture;
    cv::Mat gray;
    cv::cvtColor(SyntheticScan(options).read(0).color, gray, cv::COLOR_BGR2GRAY);
    std::vector<cv::KeyPoint> keypoints;
    cv::SIFT::create(1000)->detect(gray, keypoints);
    return keypoints.size();
  };
  const std::size_t plain = count(0), full = count(1);
  EXPECT_LT(5 * plain, full);
  EXPECT_TRUE(areSame(SyntheticScan(options).read(0).depth, SyntheticScan([] {
                                                              SyntheticScanOptions plain_options;
                                                              plain_options.num_frames = 1;
                                                              plain_options.texture = 0;
                                                              return plain_options;
                                                            }())
                                                                .read(0)
                                                                .depth));
}

TEST(SyntheticScan, GroundTruthIsThePoses)
{
  const SyntheticScan& scan = exactScan();
  const Trajectory truth = scan.groundTruth();
  ASSERT_EQ(truth.size(), scan.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(truth[i].timestamp, scan.timestamp(i));
    EXPECT_EQ(truth[i].world_from_camera.matrix(), scan.worldFromCamera(i).matrix());
    EXPECT_TRUE(isRigid(truth[i].world_from_camera.matrix(), 1e-12));
    EXPECT_EQ(scan.read(i).timestamp, scan.timestamp(i));
    EXPECT_EQ(scan.read(i).id, scan.id(i));
  }
  EXPECT_TRUE(scan.isOrdered());
}

TEST(SyntheticScan, SeedDecidesEverything)
{
  const SyntheticScan again(smallScan());
  EXPECT_TRUE(areSame(again.read(2).color, exactScan().read(2).color));
  EXPECT_TRUE(areSame(again.read(2).depth, exactScan().read(2).depth));
  SyntheticScanOptions options = smallScan();
  options.seed = 1;
  const SyntheticScan other(options);
  EXPECT_FALSE(areSame(other.read(2).color, exactScan().read(2).color));
  EXPECT_FALSE(other.worldFromCamera(2).isApprox(exactScan().worldFromCamera(2), 1e-3));
}

TEST(SyntheticScan, UnorderedFramesKeepTheirPoses)
{
  SyntheticScanOptions options = smallScan();
  options.unordered = true;
  const SyntheticScan scan(options);
  EXPECT_FALSE(scan.isOrdered());
  std::set<std::size_t> found;
  int moved = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    EXPECT_EQ(scan.timestamp(i),
              exactScan().timestamp(i)); // stamps follow the new order
    const RGBDFrame frame = scan.read(i);
    EXPECT_LT(
        largestDistance(scan, frame.depth, scan.camera(), scan.groundTruth()[i].world_from_camera),
        1e-5);
    for (std::size_t k = 0; k < scan.size(); ++k)
      if (scan.worldFromCamera(i).matrix() == exactScan().worldFromCamera(k).matrix()) {
        found.insert(k);
        moved += k != i;
      }
  }
  EXPECT_EQ(found.size(), scan.size());
  EXPECT_GT(moved, 6);
}

TEST(SyntheticScan, RefusesWhatIsOutOfBounds)
{
  using Options = SyntheticScanOptions;
  const double nan = std::nan("");
  const std::pair<std::function<void(Options&)>, const char*> cases[] = {
      {[](Options& o) { o.num_frames = 0; }, "num_frames is 0, expected 1 to"},
      {[](Options& o) { o.frame_rate = 0; }, "frame_rate [Hz] is 0, expected 0.1 to 1000"},
      {[](Options& o) { o.width = 8; }, "width [px] is 8"},
      {[](Options& o) { o.height = -480; }, "height [px] is -480"},
      {[](Options& o) { o.focal_length = 0; }, "focal length"},
      {[&](Options& o) { o.focal_length = nan; }, "not finite"},
      {[](Options& o) { o.noise_factor = -1; }, "noise_factor is -1"},
      {[](Options& o) { o.noise.constant = 0; }, "depth noise"},
      {[](Options& o) { o.quantisation = 1; }, "quantisation [1/m] is 1"},
      {[](Options& o) { o.hole_fraction = 1; }, "hole_fraction is 1, expected 0 to 0.95"},
      {[&](Options& o) { o.color_noise = nan; }, "color_noise is nan"},
      {[](Options& o) { o.blur_fraction = 1.1; }, "blur_fraction is 1.1"},
      {[](Options& o) { o.exposure_change = 1; }, "exposure_change is 1"},
      {[](Options& o) { o.depth_bias = 0.2; }, "depth_bias [1/m] is 0.2"},
      {[](Options& o) { o.focal_error = -0.6; }, "focal_error is -0.6"},
      {[](Options& o) { o.time_offset = 2; }, "time_offset [s] is 2, expected -1 to 1"},
      {[](Options& o) { o.readout = 1; }, "readout [s] is 1, expected -0.1 to 0.1"},
  };
  for (const auto& [spoil, message] : cases) {
    Options options;
    spoil(options);
    EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { SyntheticScan scan(options); }),
                    message);
  }
  EXPECT_TRUE(Options().isValid());
  EXPECT_TRUE(Options::fullNoise().isValid());
}
