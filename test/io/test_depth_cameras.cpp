// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Recordings whose depth has a camera of its own.
#include <bundle_icp/io/calibration_io.h>
#include <bundle_icp/io/rgbd_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>
#include <thread>

using namespace bundle_icp;

namespace {

class DepthCameras : public ::testing::Test {
protected:
  /** Two frames in colour of 64x48, with depth images of another size, in units of 1/5000 m. */
  void
  writeDepth(const cv::Mat& depth)
  {
    recordings::writeTum(place, 2);
    for (int i = 0; i < 2; ++i)
      recordings::writeImage(place + "/depth/" + std::to_string(i) + ".png", depth);
  }

  std::string
  openError(const DatasetOptions& options = {})
  {
    return messageOf<pcl::IOException>([&] { openDataset(place, options); });
  }

  TemporaryFolder folder;
  std::string place = folder.path("scan");
};

Finding
noteOf(const RGBDDataset& dataset)
{
  for (const Finding& finding : dataset.findings())
    if (finding.kind == "depth_camera")
      return finding;
  ADD_FAILURE() << "no finding of kind depth_camera";
  return {};
}

DatasetOptions
withDepthCamera(const std::string& intrinsics, const std::optional<Eigen::Vector3d>& place = {})
{
  DatasetOptions options;
  if (!intrinsics.empty())
    options.depth_intrinsics = parseIntrinsics(intrinsics);
  if (place)
    options.color_from_depth = Pose(Eigen::Translation3d(*place));
  return options;
}

/** Mean of what is measured in a row, and whether anything is. */
double
meanOfRow(const cv::Mat& depth, int row)
{
  const cv::Mat line = depth.row(row);
  return cv::mean(line, line == line)[0];
}

} // namespace

TEST_F(DepthCameras, SameAspectRatioIsTheSameView)
{
  // A plane that slants from top to bottom: depth of row v in colour tells where it came from.
  cv::Mat depth(24, 32, CV_16UC1);
  for (int v = 0; v < depth.rows; ++v)
    depth.row(v).setTo(std::lround(5000 / (1 - 0.01 * v)));
  writeDepth(depth);
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->camera().width, 64);
  const Finding note = noteOf(*dataset);
  EXPECT_EQ(note.severity, Severity::NOTE);
  EXPECT_CONTAINS(note.what, "depth images of 32x24 count as the same view");
  EXPECT_CONTAINS(note.what, "colour images of 64x48");
  const RGBDFrame frame = dataset->read(0);
  ASSERT_EQ(frame.depth.size(), frame.color.size());
  EXPECT_EQ(cv::norm(frame.color, recordings::color(0), cv::NORM_INF), 0);
  for (int v = 1; v < 47; ++v) // the depth pixel at v has its centre at (v + 0.5) / 2 - 0.5
    EXPECT_NEAR(meanOfRow(frame.depth, v), 1 / (1 - 0.01 * ((v + 0.5) / 2 - 0.5)), 4e-4) << v;
}

TEST_F(DepthCameras, RegisteredDepthHasNone)
{
  recordings::writeTum(place, 2);
  for (const Finding& finding : openDataset(place)->findings())
    EXPECT_NE(finding.kind, "depth_camera");
}

TEST_F(DepthCameras, AnotherAspectRatioNeedsACamera)
{
  writeDepth(recordings::depth(5000, {40, 36}));
  EXPECT_CONTAINS(openError(), "depth of 40x36");
  EXPECT_CONTAINS(openError(), "has 64x48");
  // The place alone says nothing about the lens.
  EXPECT_CONTAINS(openError(withDepthCamera("", Eigen::Vector3d(0.02, 0, 0))),
                  "--depth-intrinsics");
  const auto dataset =
      openDataset(place, withDepthCamera("40,40,20,18", Eigen::Vector3d(0.02, 0, 0)));
  EXPECT_CONTAINS(noteOf(*dataset).what, "in images of 40x36, 20 mm from the colour camera");
  const cv::Mat depth = dataset->read(1).depth;
  ASSERT_EQ(depth.size(), cv::Size(64, 48));
  EXPECT_FLOAT_EQ(depth.at<float>(24, 32), 1);
  // Depth pixel 0 is 20 / 40 m to the left at 1 m, and 20 mm nearer to the colour camera's right.
  const double left = 32 + 60 * (-0.5 + 0.02);
  EXPECT_TRUE(std::isnan(depth.at<float>(24, int(left) - 1)));
  EXPECT_FLOAT_EQ(depth.at<float>(24, int(left) + 2), 1);
}

TEST_F(DepthCameras, ComesFromTheRecordingToo)
{
  writeDepth(recordings::depth(5000, {40, 36}));
  writeText(place + "/intrinsics.txt",
            "60 60 32 24\ndepth_intrinsics 40 40 20 18\ndepth_to_color 0.02 0 0 0 0 0 1\n");
  const cv::Mat by_file = openDataset(place)->read(0).depth;
  const std::string note = noteOf(*openDataset(place)).what;
  EXPECT_CONTAINS(note, "20 mm from the colour camera");
  // The options say more, and what they leave open is the recording's.
  const auto nearer = openDataset(place, withDepthCamera("", Eigen::Vector3d(0.01, 0, 0)));
  EXPECT_CONTAINS(noteOf(*nearer).what, "fx 40, fy 40");
  EXPECT_CONTAINS(noteOf(*nearer).what, "10 mm from the colour camera");
  const auto wider = openDataset(place, withDepthCamera("30,30,20,18"));
  EXPECT_CONTAINS(noteOf(*wider).what, "fx 30, fy 30");
  EXPECT_CONTAINS(noteOf(*wider).what, "20 mm from the colour camera");
  const auto same_place = openDataset(place, withDepthCamera("", Eigen::Vector3d::Zero()));
  EXPECT_CONTAINS(noteOf(*same_place).what, "px in images of 40x36, 0 mm from the colour camera");
  writeText(place + "/intrinsics.txt", "60 60 32 24\n");
  const auto by_options =
      openDataset(place, withDepthCamera("40,40,20,18", Eigen::Vector3d(0.02, 0, 0)));
  EXPECT_EQ(cv::norm(by_options->read(0).depth, by_file, cv::NORM_INF, by_file == by_file), 0);
}

TEST_F(DepthCameras, OfRegisteredDepthIsNotUsed)
{
  recordings::writeOpen3d(place, 2);
  writeText(place + "/intrinsic.json",
            R"({"color": {"fx": 60, "fy": 60, "ppx": 32, "ppy": 24},
                "depth": {"width": 80, "height": 60, "fx": 70, "fy": 70, "ppx": 40, "ppy": 30}})");
  const auto dataset = openDataset(place);
  EXPECT_CONTAINS(noteOf(*dataset).what, "counts as registered to colour");
  EXPECT_FLOAT_EQ(dataset->read(0).depth.at<float>(0, 0), 1);
}

TEST_F(DepthCameras, SizesHaveToBeThoseOfTheCamera)
{
  writeDepth(recordings::depth(5000, {32, 24}));
  DatasetOptions options = withDepthCamera("30,30,16,12", Eigen::Vector3d::Zero());
  options.depth_intrinsics->width = 40;
  options.depth_intrinsics->height = 30;
  EXPECT_CONTAINS(openError(options), "the camera of depth has images of 40x30");
  options = withDepthCamera("30,30,200,12", Eigen::Vector3d::Zero());
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { openDataset(place, options); }),
                  "(from the camera of depth)");
  options = withDepthCamera("30,30,16,12", Eigen::Vector3d::Zero());
  options.color_from_depth->linear() *= 2;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { openDataset(place, options); }),
                  "rigid motion");
}

TEST_F(DepthCameras, MasksAreThoseOfColour)
{
  writeDepth(recordings::depth(5000, {32, 24}));
  cv::Mat mask(48, 64, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 30).setTo(0);
  recordings::writeImage(place + "/mask/0.png", mask);
  recordings::writeImage(place + "/mask/1.png", mask);
  const cv::Mat depth = openDataset(place)->read(0).depth;
  EXPECT_TRUE(std::isnan(depth.at<float>(24, 29)));
  EXPECT_FLOAT_EQ(depth.at<float>(24, 30), 1);
}

TEST_F(DepthCameras, SeveralThreadsReadTheSame)
{
  cv::Mat depth(24, 32, CV_16UC1);
  cv::RNG random(3);
  random.fill(depth, cv::RNG::UNIFORM, 4900, 5100);
  writeDepth(depth);
  const auto dataset =
      openDataset(place, withDepthCamera("30,30,16,12", Eigen::Vector3d(0.03, 0, 0.01)));
  const cv::Mat first = dataset->read(0).depth;
  cv::Mat others[4];
  std::vector<std::thread> threads;
  for (cv::Mat& other : others)
    threads.emplace_back([&dataset, &other] { other = dataset->read(0).depth; });
  for (std::thread& thread : threads)
    thread.join();
  for (const cv::Mat& other : others)
    EXPECT_EQ(std::memcmp(first.data, other.data, first.total() * sizeof(float)), 0);
}

TEST_F(DepthCameras, PlaceIsReadFromNumbersOrAFile)
{
  const Pose shifted = readDepthToColor("0.025,-0.001,0");
  EXPECT_EQ(shifted.translation(), Eigen::Vector3d(0.025, -0.001, 0));
  EXPECT_TRUE(shifted.linear().isIdentity(0));
  const double c = std::cos(0.1), s = std::sin(0.1);
  const Pose turned = readDepthToColor("0 0 0.01 " + std::to_string(std::sin(0.05)) + " 0 0 " +
                                       std::to_string(std::cos(0.05)));
  EXPECT_NEAR(turned(2, 1), s, 1e-6);
  writeText(place + "/pose.txt", "1 0 0 0\n0 " + std::to_string(c) + " " + std::to_string(-s) +
                                     " 0\n0 " + std::to_string(s) + " " + std::to_string(c) +
                                     " 0.01\n0 0 0 1\n");
  EXPECT_TRUE(readDepthToColor(place + "/pose.txt").isApprox(turned, 1e-5));
  const auto error = [](const std::string& text) {
    return messageOf<pcl::IOException>([&] { readDepthToColor(text); });
  };
  EXPECT_CONTAINS(error("absent.txt"), "absent.txt: no such file");
  EXPECT_CONTAINS(error("25,0,0"), "25 m from the colour camera; lengths are in metres");
  EXPECT_CONTAINS(error("1,2"), "2 numbers where the place of the depth camera is expected");
  writeText(place + "/pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0.02 0 0 1\n");
  EXPECT_CONTAINS(error(place + "/pose.txt"), "pose.txt: depth to colour is no rigid motion");
}
