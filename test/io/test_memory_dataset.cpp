// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/memory_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <pcl/exceptions.h>

#include <limits>

using namespace bundle_icp;

namespace {

CameraIntrinsics
camera()
{
  CameraIntrinsics camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 60;
  camera.cx = 32;
  camera.cy = 24;
  return camera;
}

RGBDFrame
frameAt(double timestamp)
{
  RGBDFrame frame;
  frame.id = 77;
  frame.timestamp = timestamp;
  frame.color = recordings::color(int(10 * timestamp));
  frame.depth = cv::Mat(48, 64, CV_32FC1, cv::Scalar(1 + timestamp));
  return frame;
}

std::string
addError(const RGBDFrame& frame)
{
  MemoryDataset dataset(camera());
  dataset.add(frameAt(0));
  const std::string error = messageOf<pcl::BadArgumentException>([&] { dataset.add(frame); });
  EXPECT_EQ(dataset.size(), 1u);
  return error;
}

} // namespace

TEST(MemoryDataset, GivesItsFrames)
{
  MemoryDataset dataset(camera());
  EXPECT_EQ(dataset.size(), 0u);
  for (int i = 0; i < 3; ++i)
    dataset.add(frameAt(0.1 * i));
  ASSERT_EQ(dataset.size(), 3u);
  EXPECT_EQ(dataset.camera().fx, 60);
  EXPECT_TRUE(dataset.isOrdered());
  EXPECT_TRUE(dataset.groundTruth().empty());
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(dataset.id(i), i);
    EXPECT_EQ(dataset.timestamp(i), 0.1 * double(i));
    EXPECT_EQ(dataset.name(i), "frame " + std::to_string(i));
    const RGBDFrame frame = dataset.read(i), given = frameAt(0.1 * double(i));
    EXPECT_EQ(frame.id, i);
    EXPECT_EQ(frame.timestamp, given.timestamp);
    EXPECT_EQ(cv::norm(frame.color, given.color, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(frame.depth, given.depth, cv::NORM_INF), 0);
  }
}

TEST(MemoryDataset, DriversMayUseTheirImagesAgain)
{
  MemoryDataset dataset(camera());
  RGBDFrame frame = frameAt(0);
  dataset.add(frame);
  frame.color.setTo(0);
  frame.depth.setTo(9);
  EXPECT_EQ(dataset.read(0).depth.at<float>(3, 4), 1);
  EXPECT_GT(cv::norm(dataset.read(0).color, cv::NORM_INF), 0);
}

TEST(MemoryDataset, IsOrderedWhileTimeGoesOn)
{
  for (const double second : {0.2, 0.1, 0.3}) {
    MemoryDataset dataset(camera());
    dataset.add(frameAt(0.2));
    dataset.add(frameAt(second));
    EXPECT_EQ(dataset.isOrdered(), second > 0.2);
    dataset.add(frameAt(0.4));
    EXPECT_EQ(dataset.isOrdered(), second > 0.2);
  }
}

TEST(MemoryDataset, RefusesFramesOfAnotherKind)
{
  RGBDFrame frame = frameAt(1);
  frame.color = cv::Mat(48, 64, CV_8UC1, cv::Scalar(0));
  EXPECT_CONTAINS(addError(frame), "MemoryDataset: frame 1: the colour image is CV_8UC1; it must "
                                   "be CV_8UC3");
  frame.color.release();
  EXPECT_CONTAINS(addError(frame), "frame 1: the colour image is empty");
  frame = frameAt(1);
  frame.depth.convertTo(frame.depth, CV_16U, 1000);
  EXPECT_CONTAINS(addError(frame), "frame 1: the depth image is CV_16UC1; it must be CV_32FC1");
  frame.depth = cv::Mat(24, 32, CV_32FC1, cv::Scalar(1));
  EXPECT_CONTAINS(addError(frame),
                  "frame 1: the depth image has 32 x 24 pixels, the camera 64 x 48");
  frame = frameAt(1);
  frame.timestamp = std::numeric_limits<double>::quiet_NaN();
  EXPECT_CONTAINS(addError(frame), "frame 1: the time stamp is not finite");
}

TEST(MemoryDataset, RefusesCamerasThatFramesCannotHave)
{
  const auto error = [](const CameraIntrinsics& camera) {
    return messageOf<pcl::BadArgumentException>([&] { MemoryDataset{camera}; });
  };
  EXPECT_CONTAINS(error(CameraIntrinsics()), "MemoryDataset: ");
  CameraIntrinsics distorted = camera();
  distorted.k1 = 0.1;
  EXPECT_CONTAINS(error(distorted), "the camera has distortion");
}
