// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What a reader assumes, says, and finds to contradict itself.
#include "io/findings.h"
#include "messages.h"

#include <boost/algorithm/string.hpp>
#include <pcl/exceptions.h>

#include <cmath>

using namespace bundle_icp;
using namespace bundle_icp::test;

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
