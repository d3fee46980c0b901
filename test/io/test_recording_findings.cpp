// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What a reader assumes, says, and finds to contradict itself.
#include <bundle_icp/io/rgbd_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <boost/algorithm/string.hpp>
#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>
#include <functional>

using namespace bundle_icp;

namespace {

/** The finding of this kind with the highest severity. */
Finding
worst(const RGBDDataset& dataset, const std::string& kind)
{
  Finding result;
  for (const Finding& finding : dataset.findings())
    if (finding.kind == kind && (result.what.empty() || finding.severity > result.severity))
      result = finding;
  EXPECT_FALSE(result.what.empty()) << "no finding of kind " << kind;
  return result;
}

class Findings : public ::testing::Test {
protected:
  /** A TUM folder of so many frames 100 ms apart, depth 4 ms later, with these stamps. */
  void
  writeLists(int num_frames, const std::function<std::string(double)>& stamp)
  {
    recordings::writeTum(place, num_frames);
    std::string rgb, depth;
    for (int i = 0; i < num_frames; ++i) {
      const std::string name = "/" + std::to_string(i) + ".png\n";
      rgb += stamp(1305031100 + 0.1 * i) + " rgb" + name;
      depth += stamp(1305031100 + 0.1 * i + 0.004) + " depth" + name;
    }
    writeText(place + "/rgb.txt", rgb);
    writeText(place + "/depth.txt", depth);
  }

  /** Names each image of an Open3D folder anew. */
  void
  writeOpen3d(int num_frames, const std::function<std::string(int)>& color,
              const std::function<std::string(int)>& depth)
  {
    for (int i = 0; i < num_frames; ++i) {
      recordings::writeImage(place + "/color/" + color(i) + ".png", recordings::color(i));
      recordings::writeImage(place + "/depth/" + depth(i) + ".png",
                             recordings::depth(1000 + 100 * i));
    }
    writeText(place + "/intrinsic.json",
              R"({"intrinsic_matrix": [60, 0, 0, 0, 61, 0, 32, 24, 1]})");
  }

  void
  expectPairs(const RGBDDataset& dataset, std::size_t number)
  {
    ASSERT_EQ(dataset.size(), number);
    for (std::size_t i = 0; i < number; ++i)
      EXPECT_EQ(cv::norm(dataset.read(i).color,
                         recordings::color(
                             int(std::lround(10 * (dataset.read(i).depth.at<float>(0, 0) - 1)))),
                         cv::NORM_INF),
                0)
          << i;
  }

  TemporaryFolder folder;
  std::string place = folder.path("scan");
};

std::string
padded(long long number, int width)
{
  const std::string digits = std::to_string(number);
  return std::string(std::max(0, width - int(digits.size())), '0') + digits;
}

} // namespace

TEST_F(Findings, GoodRecordingsHaveNotesOnly)
{
  recordings::writeTum(place, 6);
  const auto dataset = openDataset(place);
  for (const Finding& finding : dataset->findings())
    EXPECT_EQ(finding.severity, Severity::NOTE) << finding.what;
  EXPECT_CONTAINS(worst(*dataset, "format").what, "TUM RGB-D");
  EXPECT_CONTAINS(worst(*dataset, "pairing").what, "paired by time: 6 frames");
  EXPECT_CONTAINS(worst(*dataset, "pairing").what, "4 ms apart (median)");
  EXPECT_CONTAINS(worst(*dataset, "units").what, "5000 units per metre, from the format");
  EXPECT_CONTAINS(worst(*dataset, "intrinsics").what, "from " + place + "/intrinsics.txt");
  EXPECT_CONTAINS(worst(*dataset, "time_stamps").what, "in seconds");
}

TEST_F(Findings, StampsOfEveryUnitBecomeSeconds)
{
  const std::pair<double, std::string> units[] = {
      {1e3, "milliseconds"}, {1e6, "microseconds"}, {1e9, "nanoseconds"}};
  for (const auto& [factor, name] : units) {
    writeLists(6, [factor = factor](double t) {
      return std::to_string(std::llround(std::round(t * 1e3) * (factor / 1e3)));
    });
    const auto dataset = openDataset(place);
    expectPairs(*dataset, 6);
    EXPECT_CONTAINS(worst(*dataset, "time_stamps").what, name);
    EXPECT_NEAR(dataset->timestamp(3) - dataset->timestamp(0), 0.3, 1e-3);
    EXPECT_TRUE(dataset->isOrdered());
  }
}

TEST_F(Findings, StampsThatTellNothingAreNotUsed)
{
  const std::function<std::string(double)> kinds[] = {
      [](double) { return "1604644894.0"; }, [](double) { return "0"; },
      [](double t) { return std::to_string(std::llround(std::floor(t))); },
      [](double t) { return std::to_string(1e-3 * (t - 1305031100) + 1.0); }};
  for (const auto& stamp : kinds) {
    writeLists(24, stamp);
    const auto dataset = openDataset(place);
    expectPairs(*dataset, 24);
    EXPECT_FALSE(dataset->isOrdered());
    EXPECT_EQ(worst(*dataset, "time_stamps").severity, Severity::WARNING);
  }
}

TEST_F(Findings, ClockThatIsSetBack)
{
  writeLists(24, [](double t) { return std::to_string(t - 1305031100 < 1.15 ? t : t - 1.25); });
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 24);
  EXPECT_FALSE(dataset->isOrdered());
  EXPECT_CONTAINS(worst(*dataset, "time_stamps").what, "run backwards 1 times");
}

TEST_F(Findings, FrameNumbersAsStampsStayInUse)
{
  int n = 0;
  writeLists(12, [&n](double) { return std::to_string(n++ / 2); });
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 12);
  EXPECT_TRUE(dataset->isOrdered());
  EXPECT_EQ(worst(*dataset, "time_stamps").severity, Severity::NOTE);
}

TEST_F(Findings, ByteOrderMarkBlanksAndRepeatedRows)
{
  recordings::writeTum(place, 3);
  boost::filesystem::rename(place + "/rgb/1.png", place + "/rgb/frame 1.png");
  writeText(place + "/rgb.txt", "\xef\xbb\xbf# time name\n0.0 rgb/0.png\n0.0 rgb/0.png\n"
                                "0.1 rgb/frame 1.png\n0.2 rgb/2.png\n0.2 rgb/2.png\n");
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 3);
  EXPECT_TRUE(dataset->isOrdered());
}

TEST_F(Findings, OneListForBothStreams)
{
  recordings::writeTum(place, 3);
  boost::filesystem::remove(place + "/rgb.txt");
  boost::filesystem::remove(place + "/depth.txt");
  writeText(place + "/associations.txt", "0 depth/0.png 0 rgb/0.png\n1 depth/1.png 1 rgb/1.png\n");
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 2);
  EXPECT_CONTAINS(worst(*dataset, "units").what, "5000");
  boost::filesystem::remove(place + "/associations.txt");
  boost::filesystem::remove(place + "/intrinsics.txt");
  for (int i = 0; i < 3; ++i)
    for (const char* const stream : {"/rgb/", "/depth/"})
      boost::filesystem::rename(place + stream + std::to_string(i) + ".png",
                                place + stream + "130503110" + std::to_string(i) + ".25.png");
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("60,60,32,24");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place, options); }),
                  "--depth-scale (TUM 5000)");
}

TEST_F(Findings, NumberAndTimeArePairedByTime)
{
  // Depth 3 and 4 were never written; each stream numbers its own images.
  const auto name = [](int number, int frame) {
    return padded(number, 7) + "-" + padded(33333LL * frame, 12);
  };
  writeOpen3d(
      10, [&](int i) { return name(i + 1, i); },
      [&](int i) { return name(i < 3 ? i + 1 : i - 1, i); });
  boost::filesystem::remove(place + "/depth/" + name(2, 3) + ".png");
  boost::filesystem::remove(place + "/depth/" + name(3, 4) + ".png");
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 8);
  EXPECT_CONTAINS(worst(*dataset, "pairing").what, "paired by time");
  EXPECT_CONTAINS(worst(*dataset, "time_stamps").what, "microseconds");
  EXPECT_NEAR(dataset->timestamp(7), 9 * 0.033333, 1e-9);
}

TEST_F(Findings, NumberTooLargeToBeCountedIsNone)
{
  const auto name = [](int frame) {
    return std::string(24, '9') + std::to_string(frame) + "-" + padded(33333LL * frame, 12);
  };
  writeOpen3d(4, name, name);
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 4);
  EXPECT_EQ(dataset->id(3), 3u);
}

TEST_F(Findings, TheNumberThatDiffersCounts)
{
  writeOpen3d(
      12, [](int i) { return "A_hat1_color_frame" + std::to_string(i); },
      [](int i) { return "A_hat1_depth_frame" + std::to_string(i); });
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 12);
  EXPECT_EQ(dataset->id(10), 10u);
  EXPECT_CONTAINS(dataset->name(2), "frame2.png");
}

TEST_F(Findings, TwoCountersAreAFault)
{
  writeOpen3d(
      12, [](int i) { return padded(125 + i, 6); }, [](int i) { return padded(119 + i, 6); });
  const Finding finding = worst(*openDataset(place), "pairing");
  EXPECT_EQ(finding.severity, Severity::FAULT);
  EXPECT_CONTAINS(finding.what, "6 apart: they are likely two counters");
}

TEST_F(Findings, RepeatedImagesAreLeftOut)
{
  recordings::writeTum(place, 8);
  for (const int i : {1, 3, 5})
    recordings::writeImage(place + "/rgb/" + std::to_string(i) + ".png", recordings::color(i - 1));
  recordings::writeImage(place + "/rgb/7.png", recordings::color(6));
  recordings::writeImage(place + "/depth/7.png", recordings::depth(8000));
  const auto dataset = openDataset(place);
  expectPairs(*dataset, 4);
  EXPECT_CONTAINS(dataset->skipped()[0].reason, "repeats the colour image");
  EXPECT_CONTAINS(worst(*dataset, "repeated_images").what, "of 8 frames repeat");
}

TEST_F(Findings, CameraThatStandsStillKeepsItsFrames)
{
  recordings::writeTum(place, 8);
  for (int i = 1; i < 8; ++i) {
    recordings::writeImage(place + "/rgb/" + std::to_string(i) + ".png", recordings::color(0));
    recordings::writeImage(place + "/depth/" + std::to_string(i) + ".png", recordings::depth(5000));
  }
  EXPECT_EQ(openDataset(place)->size(), 8u);
  EXPECT_EQ(worst(*openDataset(place), "repeated_images").severity, Severity::NOTE);
}

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

TEST_F(Findings, TimesThatNamesContradict)
{
  const std::string rgb = place + "/rgb.txt";
  std::string list;
  for (int i = 0; i < 6; ++i) {
    const std::string time = std::to_string(0.1 * i);
    recordings::writeImage(place + "/rgb/" + time + ".png", recordings::color(i));
    recordings::writeImage(place + "/depth/" + time + ".png", recordings::depth(1000 + i));
    list += time + " rgb/" + time + ".png\n";
  }
  writeText(rgb, list);
  writeText(place + "/depth.txt", boost::replace_all_copy(list, "rgb", "depth"));
  writeText(place + "/intrinsics.txt", "60 60 32 24");
  EXPECT_EQ(worst(*openDataset(place), "time_stamps").severity, Severity::NOTE);
  boost::replace_all(list, "0.200000 rgb", "x rgb");
  boost::replace_all(list, "0.300000 rgb", "0.200000 rgb");
  boost::replace_all(list, "x rgb", "0.300000 rgb");
  writeText(rgb, list);
  const Finding finding = worst(*openDataset(place), "time_stamps");
  EXPECT_EQ(finding.severity, Severity::WARNING);
  EXPECT_CONTAINS(finding.what, "rgb.txt gives 2 of 6 images another time than their names do");
}

TEST_F(Findings, ListThatIsCutOff)
{
  recordings::writeTum(place, 6);
  EXPECT_EQ(worst(*openDataset(place), "pairing").severity, Severity::NOTE);
  const std::string list = readText(place + "/rgb.txt");
  writeText(place + "/rgb.txt", list.substr(0, list.find("0.400000")));
  const Finding finding = worst(*openDataset(place), "pairing");
  EXPECT_EQ(finding.severity, Severity::WARNING);
  EXPECT_CONTAINS(finding.what, "2 of 6 depth images were taken before or after all images of the");
}

TEST_F(Findings, HintWhenStreamsLieFurtherApart)
{
  recordings::writeTum(place, 3);
  writeText(place + "/depth.txt", "0.05 depth/0.png\n0.15 depth/1.png\n0.25 depth/2.png\n");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place); }),
                  "allow it with --max-time-difference");
  DatasetOptions options;
  options.max_time_difference = 0.06;
  EXPECT_EQ(openDataset(place, options)->size(), 3u);
}

TEST_F(Findings, ImagesThatBelongToNoFrameAreCounted)
{
  recordings::writeTum(place, 6);
  for (const Finding& finding : openDataset(place)->findings())
    EXPECT_NE(finding.kind, "unused_files") << finding.what;
  recordings::writeImage(place + "/infrared/3.png", recordings::color(3));
  recordings::writeImage(place + "/infrared/4.png", recordings::color(4));
  writeText(place + "/notes.txt", "no image");
  EXPECT_CONTAINS(worst(*openDataset(place), "unused_files").what,
                  "2 images or recordings in the folder belong to no frame, such as "
                  "infrared/3.png");
}
