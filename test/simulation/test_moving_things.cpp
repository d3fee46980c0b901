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

TEST(MovingThings, AStillCameraSeesTheSameImages)
{
  SyntheticScanOptions options = smallScan();
  options.still = true;
  const SyntheticScan scan(options);
  EXPECT_TRUE(areSame(scan.read(0).color, scan.read(scan.size() - 1).color));
  EXPECT_TRUE(areSame(scan.read(0).depth, scan.read(scan.size() - 1).depth));
}

TEST(MovingThings, ATurntableTurnsBeforeARoomThatStays)
{
  SyntheticScanOptions options = smallScan();
  options.turntable = true;
  const SyntheticScan scan(options);
  options.turntable = false;
  options.still = true;
  const SyntheticScan empty(options);
  const cv::Mat room = empty.read(0).depth;
  for (const std::size_t i : {std::size_t(0), scan.size() - 1}) {
    const cv::Mat things = scan.readExact(i).depth, seen = scan.read(i).depth;
    const cv::Mat is_thing = (things > 0) & (things < room);
    EXPECT_NEAR(cv::countNonZero(is_thing), 0.13 * double(room.total()),
                0.08 * double(room.total()));
    EXPECT_EQ(cv::countNonZero((seen != things) & is_thing), 0) << i;
    // The room is rendered from another frame of reference: but for rounding, and at edges.
    EXPECT_LT(cv::countNonZero((cv::abs(seen - room) > 1e-4) & ~is_thing), 20) << i;
    EXPECT_NEAR(scan.worldFromCamera(i).translation().norm(), 0.75, 1e-9) << i;
  }
  const Pose motion = scan.worldFromCamera(0) * scan.worldFromCamera(scan.size() - 1).inverse();
  const double turned = scan.timestamp(scan.size() - 1) * CV_PI / 6;
  EXPECT_NEAR(rotationAngle(motion), std::min(turned, 2 * CV_PI - turned), 1e-6);
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
