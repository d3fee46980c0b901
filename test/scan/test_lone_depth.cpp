// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/lone_depth.h"

#include <gtest/gtest.h>

#include <limits>

namespace {

using bundle_icp::loneDepth;

/** A wall at 2 m, a box before it at 1 m, and a rod one pixel wide before both. */
cv::Mat
wallBoxAndRod()
{
  cv::Mat depth(60, 90, CV_32FC1, cv::Scalar(2));
  depth(cv::Rect(20, 20, 30, 25)).setTo(1);
  depth.col(60).setTo(0.7);
  return depth;
}

TEST(LoneDepth, FindsSinglePixelsAndNoEdge)
{
  cv::Mat depth = wallBoxAndRod();
  EXPECT_EQ(cv::countNonZero(loneDepth(depth)), 0);
  const cv::Point wild[] = {{5, 5}, {20, 20}, {49, 30}, {75, 58}};
  for (const cv::Point& place : wild)
    depth.at<float>(place) = 5;
  cv::Mat expected(depth.size(), CV_8UC1, cv::Scalar(0));
  for (const cv::Point& place : wild)
    expected.at<uchar>(place) = 255;
  EXPECT_EQ(cv::countNonZero(loneDepth(depth) != expected), 0);
}

TEST(LoneDepth, SaysNothingWhereLittleIsMeasured)
{
  cv::Mat depth(30, 30, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  depth.at<float>(10, 10) = 1;
  depth.at<float>(10, 11) = 3; // all that is known of either is that the other lies elsewhere
  EXPECT_EQ(cv::countNonZero(loneDepth(depth)), 0);
}

} // namespace
