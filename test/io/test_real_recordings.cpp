// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// The reader on real recordings, where they are there.
#include <bundle_icp/io/rgbd_dataset.h>

#include <boost/filesystem.hpp>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <numeric>

using namespace bundle_icp;

namespace {

class RealRecording : public ::testing::Test {
protected:
  RGBDDataset::Ptr
  open(const std::string& name, const DatasetOptions& options = {})
  {
    const std::string path = std::string(BUNDLE_ICP_TEST_DATA) + "/" + name;
    return boost::filesystem::exists(path) ? openDataset(path, options) : nullptr;
  }
};

double
measuredShare(const RGBDFrame& frame)
{
  return double(cv::countNonZero(frame.depth == frame.depth)) / double(frame.depth.total());
}

// Mean rank (0 to 1) of the colour gradient at the occlusion edges of the depth: above
// 0.5 when edges of the two coincide.
double
edgeAgreement(const RGBDFrame& frame)
{
  cv::Mat grey, dx, dy, gradient, depth = frame.depth.clone(), highest;
  cv::cvtColor(frame.color, grey, cv::COLOR_BGR2GRAY);
  cv::GaussianBlur(grey, grey, {}, 1.2);
  cv::Sobel(grey, dx, CV_32F, 1, 0);
  cv::Sobel(grey, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, gradient);
  std::vector<float> sorted(gradient.begin<float>(), gradient.end<float>());
  std::sort(sorted.begin(), sorted.end());
  cv::patchNaNs(depth, 0);
  cv::dilate(depth, highest, cv::Mat::ones(3, 3, CV_8U));
  const cv::Mat edges = (depth > 0) & (highest - depth > 0.08 * depth);
  double sum = 0;
  for (int y = 0; y < edges.rows; ++y)
    for (int x = 0; x < edges.cols; ++x)
      if (edges.at<std::uint8_t>(y, x))
        sum += std::lower_bound(sorted.begin(), sorted.end(), gradient.at<float>(y, x)) -
               sorted.begin();
  return sum / double(sorted.size()) / cv::countNonZero(edges);
}

} // namespace

TEST_F(RealRecording, Freiburg1)
{
  const auto dataset = open("freiburg1_xyz_10hz");
  if (!dataset)
    GTEST_SKIP() << "freiburg1_xyz_10hz is not there";
  EXPECT_EQ(dataset->size(), 266u);
  EXPECT_EQ(dataset->camera().fx, 517.3);
  EXPECT_FALSE(dataset->camera().hasDistortion());
  EXPECT_EQ(dataset->groundTruth().size(), 3000u);
  const RGBDFrame frame = dataset->read(100);
  EXPECT_EQ(frame.id, 100u);
  EXPECT_GT(measuredShare(frame), 0.5);
  EXPECT_GT(edgeAgreement(frame), 0.6);
}

TEST_F(RealRecording, RedkitchenIsWarped)
{
  const auto dataset = open("redkitchen_every4");
  if (!dataset)
    GTEST_SKIP() << "redkitchen_every4 is not there";
  EXPECT_EQ(dataset->size(), 250u);
  EXPECT_EQ(dataset->id(249), 996u);
  EXPECT_EQ(dataset->groundTruth().size(), 250u);
  DatasetOptions unwarped;
  unwarped.intrinsics = parseIntrinsics("586.5,586.5,320,240"); // not the 7-Scenes camera
  const auto raw = open("redkitchen_every4", unwarped);
  double sum = 0, raw_sum = 0;
  for (const std::size_t i : {0, 60, 120, 180, 240}) {
    sum += edgeAgreement(dataset->read(i)) / 5;
    raw_sum += edgeAgreement(raw->read(i)) / 5;
  }
  EXPECT_GT(sum, raw_sum + 0.1);
  EXPECT_GT(sum, 0.7);
}

TEST_F(RealRecording, LivingRoom)
{
  const auto dataset = open("livingroom1_micro");
  if (!dataset)
    GTEST_SKIP() << "livingroom1_micro is not there";
  EXPECT_EQ(dataset->size(), 211u);
  EXPECT_EQ(dataset->camera().cx, 319.5);
  EXPECT_TRUE(dataset->groundTruth().empty());
  EXPECT_GT(measuredShare(dataset->read(105)), 0.9);
}
