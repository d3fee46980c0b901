// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A folder of masks beside the images of a recording.
#include <bundle_icp/io/rgbd_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>

using namespace bundle_icp;

namespace {

/** 0 in the left quarter of the image, which is left out. */
cv::Mat
leftQuarter(const cv::Size& size = {64, 48})
{
  cv::Mat mask(size, CV_8UC1, cv::Scalar(1));
  mask.colRange(0, size.width / 4).setTo(0);
  return mask;
}

Finding
maskFinding(const RGBDDataset& dataset)
{
  for (const Finding& finding : dataset.findings())
    if (finding.kind == "masks")
      return finding;
  return {};
}

/** Whether exactly the left quarter of a frame has no depth. */
bool
isMasked(const RGBDDataset& dataset, std::size_t index)
{
  const cv::Mat depth = dataset.read(index).depth;
  return cv::countNonZero((depth > 0) != (leftQuarter() > 0)) == 0;
}

bool
isWhole(const RGBDDataset& dataset, std::size_t index)
{
  const cv::Mat depth = dataset.read(index).depth;
  return cv::countNonZero(depth > 0) == int(depth.total());
}

class Masks : public ::testing::Test {
protected:
  void
  writeMask(const std::string& name, const cv::Mat& mask = leftQuarter())
  {
    recordings::writeImage(place + "/" + name, mask);
  }

  TemporaryFolder folder;
  std::string place = folder.path("recording");
};

} // namespace

TEST_F(Masks, OfATumFolderHaveTheNamesOfItsImages)
{
  recordings::writeTum(place, 4);
  for (const char* const name : {"0", "1", "3"})
    writeMask("mask/" + std::string(name) + ".png");
  const RGBDDataset::Ptr dataset = openDataset(place);
  for (const std::size_t i : {0, 1, 3})
    EXPECT_TRUE(isMasked(*dataset, i)) << i;
  EXPECT_TRUE(isWhole(*dataset, 2));
  const Finding finding = maskFinding(*dataset);
  EXPECT_EQ(finding.severity, Severity::NOTE);
  EXPECT_CONTAINS(finding.what, "3 of 4 frames have a mask");
  EXPECT_CONTAINS(finding.what, "paired by their names");
  EXPECT_CONTAINS(finding.what, "25 % of their pixels");
  EXPECT_CONTAINS(finding.what, "the other 1 are used whole");
}

TEST_F(Masks, AreIgnoredOnDemand)
{
  recordings::writeTum(place, 2);
  writeMask("mask/0.png");
  writeMask("mask/1.png");
  DatasetOptions options;
  options.use_masks = false;
  const RGBDDataset::Ptr dataset = openDataset(place, options);
  EXPECT_TRUE(isWhole(*dataset, 0));
  EXPECT_TRUE(maskFinding(*dataset).what.empty());
}

TEST_F(Masks, ArePairedByTime)
{
  recordings::writeTum(place, 3);
  std::string rgb, depth;
  for (int i = 0; i < 3; ++i) {
    const std::string time = std::to_string(1305031100 + 0.1 * i);
    rgb += time + " rgb/" + std::to_string(i) + ".png\n";
    depth += time + " depth/" + std::to_string(i) + ".png\n";
  }
  writeText(place + "/rgb.txt", rgb);
  writeText(place + "/depth.txt", depth);
  for (const char* const time : {"1305031100.004", "1305031100.107", "1305031100.300"})
    writeMask("masks/" + std::string(time) + ".png");
  const RGBDDataset::Ptr dataset = openDataset(place);
  EXPECT_TRUE(isMasked(*dataset, 0));
  EXPECT_TRUE(isMasked(*dataset, 1));
  EXPECT_TRUE(isWhole(*dataset, 2));
  EXPECT_CONTAINS(maskFinding(*dataset).what, "paired by time");
  bool is_named = false;
  for (const SkippedFile& file : dataset->skipped())
    is_named |= file.file.find("1305031100.300") != std::string::npos;
  EXPECT_TRUE(is_named);
}

TEST_F(Masks, ArePairedByNumber)
{
  recordings::writeOpen3d(place, 4);
  for (int i = 1; i < 4; ++i)
    writeMask("mask/person_000" + std::to_string(i) + ".png");
  const RGBDDataset::Ptr dataset = openDataset(place);
  EXPECT_TRUE(isWhole(*dataset, 0));
  for (const std::size_t i : {1, 2, 3})
    EXPECT_TRUE(isMasked(*dataset, i)) << i;
  EXPECT_CONTAINS(maskFinding(*dataset).what, "by the number");
}

TEST_F(Masks, OfASevenScenesFolder)
{
  for (int i = 0; i < 3; ++i) {
    recordings::writeSevenScenesFrame(place, i, recordings::color(i), recordings::depth(1000 + i));
    writeMask("mask/" + recordings::sevenScenesName(i) + ".png");
  }
  writeText(place + "/camera-intrinsics.txt", "60 0 32\n0 60 24\n0 0 1\n");
  const RGBDDataset::Ptr dataset = openDataset(place);
  for (const std::size_t i : {0, 1, 2})
    EXPECT_TRUE(isMasked(*dataset, i)) << i;
}

TEST_F(Masks, AreUndistortedWithTheImages)
{
  recordings::writeTum(place, 1);
  writeText(place + "/intrinsics.txt", "60 60 32 24 0.3 0 0 0 0");
  const RGBDDataset::Ptr whole = openDataset(place);
  writeMask("mask/0.png");
  const cv::Mat depth = openDataset(place)->read(0).depth;
  cv::Mat expected(depth.size(), CV_16UC1, cv::Scalar(5000)), undistorted;
  expected.setTo(0, leftQuarter() == 0);
  recordings::writeImage(place + "/depth/0.png", expected);
  const cv::Mat same = whole->read(0).depth; // depth that is absent where the mask is 0
  EXPECT_EQ(cv::countNonZero((depth > 0) != (same > 0)), 0);
  EXPECT_GT(cv::countNonZero(depth > 0), 1000);
}

TEST_F(Masks, WarnWhereMostFramesHaveNone)
{
  recordings::writeTum(place, 5);
  writeMask("mask/0.png");
  writeMask("mask/1.png");
  const Finding few = maskFinding(*openDataset(place));
  EXPECT_EQ(few.severity, Severity::WARNING);
  EXPECT_CONTAINS(few.remedy, "--no-mask");
}

TEST_F(Masks, WarnWhereNoneBelongsToAFrame)
{
  recordings::writeTum(place, 2);
  writeMask("mask/person.png");
  const Finding none = maskFinding(*openDataset(place));
  EXPECT_EQ(none.severity, Severity::WARNING);
  EXPECT_CONTAINS(none.what, "0 of 2 frames have a mask");
}

TEST_F(Masks, ThatHideEverythingLeaveTheFrameOut)
{
  recordings::writeTum(place, 2);
  writeMask("mask/0.png");
  writeMask("mask/1.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(0)));
  const RGBDDataset::Ptr dataset = openDataset(place);
  EXPECT_TRUE(isMasked(*dataset, 0));
  const std::string message = messageOf<pcl::IOException>([&] { dataset->read(1); });
  EXPECT_CONTAINS(message, "mask/1.png: the mask leaves out the whole image");
}

TEST_F(Masks, OfAnotherSizeOrAsJpegAreRefused)
{
  recordings::writeTum(place, 2);
  writeMask("mask/0.png", leftQuarter({32, 24}));
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place); }),
                  "mask/0.png: mask of 32x24 where the colour image has 64x48");
  boost::filesystem::remove_all(place + "/mask");
  writeMask("mask/0.jpg");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place); }),
                  "mask/0.jpg: a mask as JPEG");
}

TEST_F(Masks, OfSeveralChannelsAreZeroWhereAllAre)
{
  recordings::writeTum(place, 1);
  cv::Mat blue(48, 64, CV_8UC4, cv::Scalar(1, 0, 0, 255));
  blue.colRange(0, 16).setTo(cv::Scalar(0, 0, 0, 255));
  writeMask("mask/0.png", blue);
  EXPECT_TRUE(isMasked(*openDataset(place), 0));
}
