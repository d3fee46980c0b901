// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/joined_dataset.h>
#include <bundle_icp/io/memory_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <pcl/exceptions.h>

using namespace bundle_icp;

namespace {

CameraIntrinsics
camera(double focal_length = 60)
{
  CameraIntrinsics camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = focal_length;
  camera.cx = 32;
  camera.cy = 24;
  return camera;
}

/** Two frames, from a time on. */
RGBDDataset::Ptr
recordingFrom(double time, const CameraIntrinsics& of_camera = camera())
{
  auto dataset = std::make_shared<MemoryDataset>(of_camera);
  for (int i = 0; i < 2; ++i)
    dataset->add({std::size_t(i), time + 0.1 * i, recordings::color(int(time) + i),
                  cv::Mat(48, 64, CV_32FC1, cv::Scalar(1 + time))});
  return dataset;
}

} // namespace

TEST(JoinedDataset, HasTheFramesOfAll)
{
  const JoinedDataset joined({recordingFrom(5), recordingFrom(0), recordingFrom(9)});
  ASSERT_EQ(joined.size(), 6u);
  EXPECT_EQ(joined.id(3), 1u);
  EXPECT_EQ(joined.timestamp(3), 0.1);
  EXPECT_EQ(joined.name(3), "frame 1");
  EXPECT_FLOAT_EQ(joined.read(3).depth.at<float>(0, 0), 1);
  EXPECT_FLOAT_EQ(joined.read(4).depth.at<float>(0, 0), 10);
  EXPECT_TRUE(joined.isOrdered());
  EXPECT_TRUE(joined.groundTruth().empty());
  EXPECT_EQ(joined.format(), "memory");
  EXPECT_TRUE(joined.findings().empty());
}

TEST(JoinedDataset, TimeTellsNothingWhereRecordingsOverlap)
{
  const JoinedDataset joined({recordingFrom(0), recordingFrom(0.1)});
  EXPECT_FALSE(joined.isOrdered());
  ASSERT_EQ(joined.findings().size(), 1u);
  EXPECT_EQ(joined.recordings().size(), 2u);
  EXPECT_CONTAINS(joined.ownFindings().at(0).what,
                  "2 recordings are joined; their time stamps overlap");
}

TEST(JoinedDataset, PartsOfOneRecordingKeepItsTime)
{
  const double day = 1305031102;
  EXPECT_TRUE(JoinedDataset({recordingFrom(day), recordingFrom(day + 0.05)}).isOrdered());
  EXPECT_FALSE(JoinedDataset({recordingFrom(day), recordingFrom(day)}).isOrdered());
}

TEST(JoinedDataset, RefusesWhatCannotBeJoined)
{
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] {
                    CameraIntrinsics noisy = camera();
                    noisy.depth_noise.constant *= 2;
                    JoinedDataset({recordingFrom(0), recordingFrom(1, noisy)});
                  }),
                  "depth sensors with other noise cannot be joined");
  const auto empty = std::make_shared<MemoryDataset>(camera());
  for (const RGBDDataset::Ptr& none : {RGBDDataset::Ptr(), RGBDDataset::Ptr(empty)})
    EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] {
                      JoinedDataset({recordingFrom(0), none});
                    }),
                    "a recording is null or has no frames");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([] { JoinedDataset({}); }),
                  "there are no recordings");
}
