// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/trajectory.h>

#include "messages.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <csignal>
#include <sys/resource.h>

using namespace bundle_icp;

TEST(Trajectory, WritesWhatItReads)
{
  const TemporaryFolder folder;
  Trajectory trajectory;
  for (int i = 0; i < 20; ++i) {
    Vector6d motion;
    motion << 0.3 * i, -0.2 * i, 0.1, 12.3456789 + i, -0.00000012, 1e-3 * i;
    trajectory.push_back({1305031102.175304 + 0.033333 * i, increment(motion)});
  }
  writeTrajectory(folder.path("t.txt"), trajectory);
  const Trajectory read = readTrajectory(folder.path("t.txt"));
  ASSERT_EQ(read.size(), trajectory.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_NEAR(read[i].timestamp, trajectory[i].timestamp, 1e-6);
    const Pose& pose = trajectory[i].world_from_camera;
    EXPECT_LT((read[i].world_from_camera.matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(Trajectory, GivesThePoseNearestInTime)
{
  Trajectory trajectory;
  for (const double time : {1.0, 2.0, 4.0})
    trajectory.push_back({time, Pose(Eigen::Translation3d(time, 0, 0))});
  const auto timeOf = [&](double time, double max_difference) {
    const auto pose = poseAt(trajectory, time, max_difference);
    return pose ? pose->translation().x() : 0;
  };
  EXPECT_EQ(timeOf(0.5, 1), 1);
  EXPECT_EQ(timeOf(2, 0), 2);
  EXPECT_EQ(timeOf(2.9, 1), 2);
  EXPECT_EQ(timeOf(3.1, 1), 4);
  EXPECT_EQ(timeOf(5, 1), 4);
  EXPECT_EQ(timeOf(3.1, 0.5), 0);
  EXPECT_EQ(timeOf(0.5, 0.4), 0);
  EXPECT_FALSE(poseAt({}, 1, 10));
}

TEST(Trajectory, SortsAndLetsTheLastOfEqualStampsCount)
{
  const TemporaryFolder folder;
  writeText(folder.path("t.txt"), "# comment\r\n"
                                  "2, 1 0 0, 0 0 0 1\r\n"
                                  "1\t2 0 0 0 0 0 1 # comment\n\n"
                                  "2 3 0 0 0 0 0.7071 0.7071\n");
  const Trajectory read = readTrajectory(folder.path("t.txt"));
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].timestamp, 1);
  EXPECT_EQ(read[1].world_from_camera.translation().x(), 3);
  EXPECT_TRUE(isRigid(read[1].world_from_camera.matrix(), 1e-12));
  EXPECT_NEAR(rotationAngle(read[1].world_from_camera), M_PI / 2, 1e-12);
}

TEST(Trajectory, RefusesBadLinesNamingThem)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("t.txt");
  const auto error = [&] { return messageOf<pcl::IOException>([&] { readTrajectory(path); }); };
  EXPECT_CONTAINS(error(), "t.txt: cannot be opened: No such file");
  for (const auto& [text, reason] : std::vector<std::pair<std::string, std::string>>{
           {"", "t.txt: holds no pose"},
           {"# only a comment\n", "t.txt: holds no pose"},
           {"0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n", "t.txt:2: 7 words; expected 8"},
           {"0 0 0 0 0 0 0 1 5\n", "t.txt:1: 9 words; expected 8"},
           {"0 0 0 x 0 0 0 1\n", "t.txt:1: 'x' is not a number"},
           {"0 0 0 1.5m 0 0 0 1\n", "t.txt:1: '1.5m' is not a number"},
           {"\n0 nan 0 0 0 0 0 1\n", "t.txt:2: 'nan' is not a finite number"},
           {"0 0 -inf 0 0 0 0 1\n", "t.txt:1: '-inf' is not a finite number"},
           {"0 0 0 0 0 0 0 0\n", "t.txt:1: the quaternion has length 0.000000"},
           {"0 0 0 0 0 0 1 1\n", "t.txt:1: the quaternion has length 1.414214"}}) {
    writeText(path, text);
    EXPECT_CONTAINS(error(), reason);
  }
}

TEST(Trajectory, ReadsTimestampsOfLists)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("rgb.txt");
  writeText(path, "# time file\n0.5 a.png\n0.25 b.png # c\n");
  EXPECT_EQ(readTimestamps(path), (std::vector<double>{0.5, 0.25}));
  writeText(path, "0.5 a.png\nb.png 0.25\n");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { readTimestamps(path); }),
                  "rgb.txt:2: 'b.png' is not a number");
  writeText(path, "# nothing\n");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { readTimestamps(path); }),
                  "rgb.txt: holds no time stamp");
}

TEST(Trajectory, FullDiskKeepsTheOldFile)
{
  const TemporaryFolder folder;
  const std::string path = folder.path("t.txt");
  writeText(path, "old");
  // A limit on the size of files acts as a disk with 4 KiB left.
  rlimit old_limit{}, limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  limit = {4096, old_limit.rlim_max};
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &limit);
  const std::string message =
      messageOf<pcl::IOException>([&] { writeTrajectory(path, Trajectory(1000)); });
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_CONTAINS(message, path + ": cannot be written");
  EXPECT_EQ(readText(path), "old");
  EXPECT_EQ(std::distance(boost::filesystem::directory_iterator(folder.path()), {}), 1);
}
