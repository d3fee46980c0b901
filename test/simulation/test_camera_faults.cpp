// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Each fault of the synthetic camera, against the exact frame.
#include "scans.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <thread>

using namespace bundle_icp;

namespace {

/** A scan with one fault. */
template <typename Spoil>
SyntheticScan
scanWith(Spoil&& spoil)
{
  SyntheticScanOptions options = smallScan();
  spoil(options);
  return SyntheticScan(options);
}

struct Moments {
  double count = 0, sum = 0, squares = 0;

  void
  add(double x)
  {
    ++count;
    sum += x;
    squares += x * x;
  }
  double
  mean() const
  {
    return sum / count;
  }
  double
  deviation() const
  {
    return std::sqrt(squares / count - mean() * mean());
  }
};

double
sharpness(const cv::Mat& color)
{
  cv::Mat gray, laplacian;
  cv::cvtColor(color, gray, cv::COLOR_BGR2GRAY);
  cv::Laplacian(gray, laplacian, CV_32F);
  return cv::norm(laplacian);
}

} // namespace

TEST(CameraFaults, DepthNoiseHasTheStatedDeviation)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.noise_factor = 1; });
  const DepthNoise noise;
  Moments by_depth[3], by_place[4], neighbors;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const cv::Mat exact = scan.readExact(i).depth, measured = scan.read(i).depth;
    float left = 0;
    for (int y = 0; y < exact.rows; ++y)
      for (int x = 0; x < exact.cols; ++x) {
        const float z = exact.at<float>(y, x);
        // Away from the ends of the range, which would cut the noise off.
        if (z < 0.6 || z > 4.5)
          continue;
        const double deviation = (measured.at<float>(y, x) - z) / noise.sigma(z);
        by_depth[z < 1.4 ? 0 : z < 2.2 ? 1 : 2].add(deviation);
        by_place[2 * (y % 2) + x % 2].add(deviation);
        if (x > 0)
          neighbors.add(deviation * left);
        left = float(deviation);
      }
  }
  for (const Moments& moments : by_depth) {
    ASSERT_GT(moments.count, 10000);
    EXPECT_NEAR(moments.deviation(), 1, 0.05);
    EXPECT_NEAR(moments.mean(), 0, 0.05);
  }
  for (const Moments& moments : by_place)
    EXPECT_NEAR(moments.deviation(), 1, 0.05);
  EXPECT_GT(neighbors.mean(), 0.2);
  EXPECT_LT(neighbors.mean(), 0.6);
}

TEST(CameraFaults, NoiseFactorScalesAndLimitsTheRange)
{
  const SyntheticScan scan = scanWith([](auto& o) {
    o.noise_factor = 3;
    o.noise = {0.002, 0, 0};
  });
  Moments moments;
  for (std::size_t i = 0; i < 4; ++i) {
    const cv::Mat exact = scan.readExact(i).depth, measured = scan.read(i).depth;
    for (int y = 0; y < exact.rows; ++y)
      for (int x = 0; x < exact.cols; ++x) {
        const float z = exact.at<float>(y, x), m = measured.at<float>(y, x);
        if (z > 5.05 || z < 0.35) {
          EXPECT_TRUE(std::isnan(m));
        }
        else if (z > 0.5 && z < 4.9)
          moments.add(m - z);
      }
  }
  EXPECT_NEAR(moments.deviation(), 0.006, 0.0003);
}

TEST(CameraFaults, QuantisedDepthIsWholeStepsOfDisparity)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.quantisation = 0.0028; });
  const cv::Mat exact = scan.readExact(0).depth, measured = scan.read(0).depth;
  for (int y = 0; y < exact.rows; ++y)
    for (int x = 0; x < exact.cols; ++x) {
      const double z = exact.at<float>(y, x), m = measured.at<float>(y, x);
      const double disparity = 1 / (0.0028 * m);
      ASSERT_NEAR(disparity, std::round(disparity), 1e-3);
      ASSERT_LT(std::abs(m - z), 0.52 * 0.0028 * z * z);
    }
}

TEST(CameraFaults, DepthBiasGrowsWithDepth)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.depth_bias = 0.01; });
  const cv::Mat exact = scan.readExact(1).depth, measured = scan.read(1).depth;
  for (int y = 0; y < exact.rows; ++y)
    for (int x = 0; x < exact.cols; ++x) {
      const double z = exact.at<float>(y, x);
      ASSERT_NEAR(measured.at<float>(y, x), z * (1 + 0.01 * z), 1e-5);
    }
}

TEST(CameraFaults, FocalErrorIsOnlyInWhatIsReported)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.focal_error = 0.02; });
  EXPECT_NEAR(scan.camera().fx, 131 * 1.02, 1e-9);
  EXPECT_NEAR(scan.camera().fy, 131 * 1.02, 1e-9);
  const RGBDFrame frame = scan.read(2);
  EXPECT_TRUE(areSame(frame.color, exactScan().read(2).color));
  const Pose pose = scan.worldFromCamera(2);
  EXPECT_LT(largestDistance(scan, frame.depth, smallScan().trueCamera(), pose), 1e-5);
  EXPECT_GT(largestDistance(scan, frame.depth, scan.camera(), pose), 5e-3);
}

TEST(CameraFaults, TimeOffsetShowsDepthFromALaterPose)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.time_offset = 0.5; });
  // At two frames a second the depth is that of the next frame.
  EXPECT_TRUE(areSame(scan.read(2).depth, exactScan().read(3).depth));
  EXPECT_TRUE(areSame(scan.read(2).color, exactScan().read(2).color));
  EXPECT_TRUE(areSame(scan.readExact(2).depth, exactScan().read(2).depth));
}

TEST(CameraFaults, RollingShutterShowsEachRowAtItsTime)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.readout = 0.06; });
  const SyntheticScan every_millisecond = scanWith([](auto& o) {
    o.frame_rate = 1000;
    o.num_frames = 600;
  });
  const RGBDFrame frame = scan.read(1), exact = scan.readExact(1);
  EXPECT_TRUE(areSame(frame.depth, exact.depth));
  const auto difference = [&frame](const cv::Mat& color, int y) {
    return cv::norm(frame.color.rowRange(y, y + 4), color.rowRange(y, y + 4), cv::NORM_L1) /
           (4 * 160 * 3);
  };
  for (const int y : {0, 20, 40, 80, 116}) {
    // Four rows take 2 ms, the middle of the image is at the stamp, 500 ms.
    const auto millisecond = std::size_t(500 + (y + 2) / 2 - 30);
    EXPECT_LT(difference(every_millisecond.readExact(millisecond).color, y), 0.05) << y;
    if (std::abs(y - 58) > 20) { // far from the middle
      EXPECT_GT(difference(exact.color, y), 1) << y;
    }
  }
  EXPECT_LT(difference(exact.color, 58), 0.5);
}

TEST(CameraFaults, HolesArePatchesInTheDark)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.hole_fraction = 0.1; });
  double holes = 0, pixels = 0, pairs = 0, dark = 0, all = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const RGBDFrame frame = scan.read(i);
    const cv::Mat exact = scan.readExact(i).depth;
    for (int y = 0; y < frame.depth.rows; ++y)
      for (int x = 1; x < frame.depth.cols; ++x) {
        const bool is_hole = std::isnan(frame.depth.at<float>(y, x));
        const cv::Vec3b color = frame.color.at<cv::Vec3b>(y, x);
        const double gray = (color[0] + color[1] + color[2]) / 3.0;
        ++pixels;
        all += gray;
        if (!is_hole) {
          ASSERT_EQ(frame.depth.at<float>(y, x), exact.at<float>(y, x));
          continue;
        }
        ++holes;
        dark += gray;
        pairs += std::isnan(frame.depth.at<float>(y, x - 1));
      }
  }
  EXPECT_NEAR(holes / pixels, 0.1, 0.003);
  EXPECT_GT(pairs / holes, 0.7); // at random it would be 0.1
  EXPECT_LT(dark / holes, all / pixels);
}

TEST(CameraFaults, FlyingPixelsLieBetweenForegroundAndBackground)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.flying_pixels = true; });
  const cv::Mat exact = scan.readExact(0).depth, measured = scan.read(0).depth;
  cv::Mat front, back;
  cv::erode(exact, front, cv::Mat());
  cv::dilate(exact, back, cv::Mat());
  int flying = 0, edges = 0;
  for (int y = 0; y < exact.rows; ++y)
    for (int x = 0; x < exact.cols; ++x) {
      const float m = measured.at<float>(y, x), z = exact.at<float>(y, x);
      const float near = front.at<float>(y, x), far = back.at<float>(y, x);
      edges += far - near > 0.3f;
      if (m == z)
        continue;
      ++flying;
      EXPECT_GT(far - near, 0.03f);
      EXPECT_GE(m, near);
      EXPECT_LE(m, far);
    }
  EXPECT_GT(flying, 0.3 * edges);
  EXPECT_LT(flying, 0.1 * double(exact.total()));
}

TEST(CameraFaults, ColorNoiseHasTheStatedDeviation)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.color_noise = 4; });
  const cv::Mat exact = scan.readExact(0).color, measured = scan.read(0).color;
  Moments moments;
  for (int y = 0; y < exact.rows; ++y)
    for (int x = 0; x < exact.cols; ++x)
      for (int c = 0; c < 3; ++c)
        if (const int value = exact.at<cv::Vec3b>(y, x)[c]; value > 20 && value < 235)
          moments.add(measured.at<cv::Vec3b>(y, x)[c] - value);
  EXPECT_NEAR(moments.deviation(), 4, 0.2);
  EXPECT_NEAR(moments.mean(), 0, 0.1);
}

TEST(CameraFaults, BlurredFramesAreBlurredAndFlagged)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.blur_fraction = 0.5; });
  int blurred = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const RGBDFrame frame = scan.read(i), exact = scan.readExact(i);
    EXPECT_TRUE(areSame(frame.depth, exact.depth));
    blurred += scan.isBlurred(i);
    if (scan.isBlurred(i)) {
      EXPECT_LT(sharpness(frame.color), 0.8 * sharpness(exact.color)) << i;
      EXPECT_NEAR(cv::mean(frame.color)[0], cv::mean(exact.color)[0],
                  8); // no shift of place
    }
    else {
      EXPECT_TRUE(areSame(frame.color, exact.color)) << i;
    }
  }
  EXPECT_GT(blurred, 1);
  EXPECT_LT(blurred, 11);
}

TEST(CameraFaults, ExposureChangesWithinItsAmplitude)
{
  const SyntheticScan scan = scanWith([](auto& o) { o.exposure_change = 0.2; });
  double least = 10, most = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double gain = cv::mean(scan.read(i).color)[1] / cv::mean(scan.readExact(i).color)[1];
    least = std::min(least, gain);
    most = std::max(most, gain);
  }
  EXPECT_GT(least, 0.79);
  EXPECT_LT(least, 0.95);
  EXPECT_LT(most, 1.21);
  EXPECT_GT(most, 1.05);
}

TEST(CameraFaults, DependOnFrameAndSeedNotOnTheOrderOfReading)
{
  SyntheticScanOptions options = SyntheticScanOptions::fullNoise();
  options.width = 160;
  options.height = 120;
  options.focal_length = 131;
  options.num_frames = 6;
  options.blur_fraction = 0.3;
  const SyntheticScan scan(options), again(options);
  std::vector<RGBDFrame> forwards(scan.size()), backwards(scan.size());
  // At the same time from two threads, in opposite orders.
  std::thread other([&] {
    for (std::size_t i = scan.size(); i-- > 0;)
      backwards[i] = scan.read(i);
  });
  for (std::size_t i = 0; i < scan.size(); ++i)
    forwards[i] = scan.read(i);
  other.join();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    EXPECT_TRUE(areSame(forwards[i].color, backwards[i].color)) << i;
    EXPECT_TRUE(areSame(forwards[i].depth, backwards[i].depth)) << i;
  }
  EXPECT_TRUE(areSame(again.read(4).depth, forwards[4].depth));
  cv::Mat difference = cv::abs(forwards[0].depth - forwards[1].depth);
  EXPECT_GT(cv::norm(difference, cv::NORM_INF, difference == difference), 0);
}
