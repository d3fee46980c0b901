// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/staying_pixels.h"

#include "changed_scan.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

const cv::Scalar white = cv::Scalar::all(255);

void
writeText(cv::Mat& image, const cv::Scalar& color, double scale)
{
  for (const int y : {40, 120, 200})
    cv::putText(image, "CAM-01 2026-05-17", {20, y}, cv::FONT_HERSHEY_SIMPLEX, scale, color, 2);
}

cv::Mat
textMask(const ChangedScan& scan, double scale)
{
  cv::Mat mask(scan.camera().height, scan.camera().width, CV_8UC1, cv::Scalar(0));
  writeText(mask, white, scale);
  return mask;
}

} // namespace

TEST(FindImageMark, FindsTextOfAnyColour)
{
  for (const cv::Scalar& color : {white, cv::Scalar(0, 255, 0), cv::Scalar(20, 20, 20)})
    for (const double scale : {0.5, 0.8}) {
      ChangedScan scan;
      scan.change = [&](std::size_t, RGBDFrame& frame) { writeText(frame.color, color, scale); };
      const cv::Mat mark = findStayingPixels(scan, 0).mark, text = textMask(scan, scale);
      ASSERT_FALSE(mark.empty()) << color << scale;
      EXPECT_GT(cv::countNonZero(mark & text), 0.9 * cv::countNonZero(text)) << color << scale;
      cv::Mat around;
      cv::dilate(text, around, cv::Mat(), {-1, -1}, 12);
      EXPECT_EQ(cv::countNonZero(mark & ~around), 0) << color << scale;
    }
}

TEST(FindImageMark, ABlackFrameAtTheStartHidesNoMark)
{
  ChangedScan scan;
  scan.change = [](std::size_t index, RGBDFrame& frame) {
    writeText(frame.color, white, 0.8);
    if (index == 0) {
      frame.color.setTo(cv::Scalar::all(0));
      frame.depth.setTo(NAN);
    }
  };
  EXPECT_FALSE(findStayingPixels(scan, 0).mark.empty());
}

TEST(FindImageMark, FindsNothingWithoutOne)
{
  const auto mark = [](const std::function<void(std::size_t, RGBDFrame&)>& change) {
    ChangedScan scan;
    scan.change = change;
    return findStayingPixels(scan, 0).mark;
  };
  EXPECT_TRUE(mark({}).empty());
  EXPECT_TRUE(mark([](std::size_t, RGBDFrame& frame) {
                cv::rectangle(frame.color, {0, 0, 40, frame.color.rows}, cv::Scalar(), cv::FILLED);
              }).empty())
      << "a black border";
  EXPECT_TRUE(mark([](std::size_t index, RGBDFrame& frame) {
                cv::putText(frame.color, "X", {10 * int(index), 100}, cv::FONT_HERSHEY_SIMPLEX, 2,
                            white, 3);
              }).empty())
      << "a thing that moves";
}

TEST(FindImageMark, ACameraThatRestsMarksNothing)
{
  ChangedScan scan;
  scan.change = [&](std::size_t index, RGBDFrame& frame) {
    if (index > 8)
      frame = scan.original(9);
  };
  EXPECT_TRUE(findStayingPixels(scan, 0).mark.empty());
}
