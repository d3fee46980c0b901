// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What a reader assumes of the camera, and what of its files contradicts itself.
#include "io/findings.h"
#include "messages.h"

#include <boost/algorithm/string.hpp>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

TEST_F(Findings, CameraOfSevenScenesOnlyForSevenScenes)
{
  const cv::Size size(640, 480);
  recordings::writeSevenScenesFrame(place, 0, recordings::color(0, size),
                                    recordings::depth(1000, size));
  EXPECT_EQ(openDataset(place)->camera().fx, 585);
  boost::filesystem::remove(place + "/frame-000000.pose.txt");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place); }),
                  "intrinsics are unknown");
  writeText(place + "/_info.txt",
            "m_versionNumber = 4\nm_sensorName = Structure Sensor\nm_colorWidth = 640\n"
            "m_colorHeight = 480\nm_depthWidth = 640\nm_depthHeight = 480\nm_depthShift = 2000\n"
            "m_calibrationColorIntrinsic = 577 0 318 0 0 578 241 0 0 0 1 0 0 0 0 1\n");
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->camera().fy, 578);
  EXPECT_EQ(dataset->camera().cx, 318);
  EXPECT_FLOAT_EQ(dataset->read(0).depth.at<float>(0, 0), 0.5f);
  EXPECT_CONTAINS(worst(*dataset, "intrinsics").what, "_info.txt");
}

TEST_F(Findings, TwoSizesOfAScanNetRecorder)
{
  const auto write = [this](const cv::Size& color) {
    recordings::writeSevenScenesFrame(place, 0, recordings::color(0, color),
                                      recordings::depth(1000, {64, 48}));
    writeText(place + "/_info.txt",
              "m_colorWidth = 129\nm_colorHeight = 97\nm_depthWidth = 64\nm_depthHeight = 48\n"
              "m_depthShift = 1000\n"
              "m_calibrationColorIntrinsic = 117 0 64 0 0 118 48 0 0 0 1 0 0 0 0 1\n"
              "m_calibrationDepthIntrinsic = 57 0 32 0 0 58 24 0 0 0 1 0 0 0 0 1\n");
  };
  write({129, 97});
  EXPECT_EQ(openDataset(place)->camera().fy, 118);
  EXPECT_EQ(openDataset(place)->read(0).depth.size(), cv::Size(129, 97));
  EXPECT_FLOAT_EQ(openDataset(place)->read(0).depth.at<float>(48, 64), 1);
  EXPECT_CONTAINS(worst(*openDataset(place), "depth_camera").what, "fx 57, fy 58");
  write({64, 48}); // colour was brought to depth
  EXPECT_EQ(openDataset(place)->camera().fy, 58);
  EXPECT_FLOAT_EQ(openDataset(place)->read(0).depth.at<float>(0, 0), 1);
}

TEST_F(Findings, TheInfoOfSomeoneElseIsNoCalibration)
{
  recordings::writeSevenScenesFrame(place, 0, recordings::color(0, {64, 48}),
                                    recordings::depth(1000, {64, 48}));
  writeText(place + "/camera-intrinsics.txt", "57 0 32\n0 58 24\n0 0 1\n");
  writeText(place + "/info.txt", "taken on Monday\nlens = 24mm f/2\n");
  EXPECT_EQ(openDataset(place)->camera().fy, 58);
  EXPECT_EQ(openDataset(place)->format(), "7-Scenes");
}

TEST_F(Findings, FaultsOfAScanNetRecordersFileHarmOnlyWhereItIsNeeded)
{
  recordings::writeSevenScenesFrame(place, 0, recordings::color(0, {64, 48}),
                                    recordings::depth(1000, {64, 48}));
  const std::string camera = "m_calibrationColorIntrinsic = 57 0 32 0 0 58 24 0 0 0 1 0 0 0 0 1\n";
  const std::pair<std::string, const char*> faults[] = {
      {"m_colorWidth = 1e20\n" + camera, "m_colorWidth is no size of an image"},
      {"m_calibrationColorIntrinsic = 57 none\n", "'none' is not a number"},
      {camera + "m_calibrationDepthExtrinsic = 1 0 0 0.02 0 1 0 0 0 0 1 0 0 0 0 1\n",
       "depth is not registered to colour"}};
  for (const auto& [text, reason] : faults) {
    writeText(place + "/_info.txt", text);
    const std::string message = messageOf<pcl::IOException>([&] { openDataset(place); });
    EXPECT_CONTAINS(message, "_info.txt");
    EXPECT_CONTAINS(message, reason);
    DatasetOptions options;
    options.intrinsics = parseIntrinsics("57,58,32,24");
    EXPECT_EQ(openDataset(place, options)->camera().fy, 58);
  }
  writeText(place + "/_info.txt",
            camera + "m_calibrationDepthExtrinsic = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n");
  EXPECT_EQ(openDataset(place)->camera().fy, 58);
}

TEST_F(Findings, CalibrationsAsOthersWriteThem)
{
  const std::string numbers = R"("fx": 60, "fy": 61, "ppx": 32, "ppy": 24)";
  const std::string texts[] = {
      R"({"intrinsic_matrix": [[60, 0, 32], [0, 61, 24], [0, 0, 1]]})", "{" + numbers + "}",
      R"({"intrinsic": {"intrinsic_matrix": [60, 0, 0, 0, 61, 0, 32, 24, 1]}})"};
  recordings::writeOpen3d(place, 1);
  for (const std::string& text : texts) {
    writeText(place + "/intrinsic.json", text);
    EXPECT_EQ(openDataset(place)->camera().fy, 61) << text;
    EXPECT_EQ(openDataset(place)->camera().cx, 32) << text;
  }
  std::string wide = "\xff\xfe";
  for (const char letter : texts[0])
    wide += {letter, '\0'};
  writeText(place + "/intrinsic.json", wide);
  EXPECT_EQ(openDataset(place)->camera().fy, 61);
}
