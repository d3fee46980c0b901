// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scans.h"

#include <gtest/gtest.h>

using namespace bundle_icp;

namespace {

/** Pixels whose depth differs from that of the room alone. */
cv::Mat
moved(const SyntheticScan& scan, std::size_t index)
{
  return scan.read(index).depth != scan.readExact(index).depth;
}

} // namespace

TEST(MovingThings, TheGripperStaysInTheImage)
{
  SyntheticScanOptions options = smallScan();
  options.gripper = true;
  const SyntheticScan scan(options);
  const cv::Mat first = scan.read(0).depth, last = scan.read(11).depth;
  const cv::Mat gripper = moved(scan, 0);
  EXPECT_TRUE(areSame(gripper, moved(scan, 11)));
  EXPECT_EQ(cv::countNonZero((first != last) & gripper), 0);
  EXPECT_NEAR(cv::countNonZero(gripper), 0.15 * double(gripper.total()),
              0.1 * double(gripper.total()));
  EXPECT_EQ(cv::countNonZero(gripper.rowRange(0, gripper.rows / 2)), 0);
}

TEST(MovingThings, ThePersonIsInFrontOfTheRoomAndWalks)
{
  SyntheticScanOptions options = smallScan();
  options.person = true;
  options.num_frames = 24;
  const SyntheticScan scan(options);
  std::size_t frames_with_person = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const cv::Mat person = moved(scan, i);
    const cv::Mat nearer = scan.read(i).depth < scan.readExact(i).depth;
    EXPECT_EQ(cv::countNonZero(person != nearer), 0) << i;
    frames_with_person += cv::countNonZero(person) > 0.01 * double(person.total());
  }
  EXPECT_GT(frames_with_person, 2u);
  EXPECT_LT(frames_with_person, scan.size());
}

TEST(MovingThings, ChangeNeitherPathNorRoom)
{
  SyntheticScanOptions options = smallScan();
  options.gripper = options.person = true;
  const SyntheticScan scan(options);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    EXPECT_EQ(scan.worldFromCamera(i).matrix(), exactScan().worldFromCamera(i).matrix());
    EXPECT_TRUE(areSame(scan.readExact(i).color, exactScan().readExact(i).color));
  }
}

TEST(MovingThings, MasksHideThem)
{
  SyntheticScanOptions options = smallScan();
  options.gripper = options.person = true;
  const SyntheticScan scan(options);
  for (const std::size_t i : {0, 6, 11}) {
    const cv::Mat mask = scan.mask(i), things = moved(scan, i);
    EXPECT_EQ(cv::countNonZero(things & mask), 0) << i;
    cv::Mat around;
    cv::dilate(things, around, cv::Mat::ones(5, 5, CV_8UC1));
    EXPECT_EQ(cv::countNonZero((mask == 0) != around), 0) << i;
  }
}
