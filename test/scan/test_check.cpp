// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Faults that are put into simulated scans, and what checkRecording() says of them.
#include <bundle_icp/scan/check.h>

#include "changed_scan.h"
#include "messages.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** The most serious finding of a kind; empty without one above NOTE. */
Finding
worst(const RGBDDataset& dataset, const std::string& kind)
{
  Finding result;
  for (const Finding& finding : checkRecording(dataset))
    if (finding.kind == kind && finding.severity > result.severity)
      result = finding;
  return result;
}

} // namespace

TEST(CheckRecording, GoodScansHaveNotesOnly)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  for (const std::uint64_t seed : {1, 2, 3, 4})
    for (const Finding& finding : checkRecording(SyntheticScan(smallScan(seed))))
      EXPECT_EQ(finding.severity, Severity::NOTE) << seed << ": " << finding.what;
}

TEST(CheckRecording, DepthOfNoRoom)
{
  ChangedScan scan;
  scan.change = [](std::size_t, RGBDFrame& frame) { frame.depth *= 10; };
  EXPECT_EQ(worst(scan, "units").severity, Severity::FAULT);
  EXPECT_CONTAINS(worst(scan, "units").remedy, "10000 for 0.1 mm");
  scan.change = [](std::size_t, RGBDFrame& frame) { frame.depth *= 0.2; };
  EXPECT_EQ(worst(scan, "units").severity, Severity::FAULT);
  EXPECT_CONTAINS(worst(scan, "units").what, "too near for the sensor (kinect)");
  scan.change = [](std::size_t, RGBDFrame& frame) { frame.depth *= 0.001; };
  EXPECT_CONTAINS(worst(scan, "units").remedy, "a thousandth");
  scan.change = [](std::size_t, RGBDFrame& frame) { frame.depth.setTo(NAN); };
  EXPECT_CONTAINS(worst(scan, "units").what, "has depth");
}

TEST(CheckRecording, CamerasThatAreNone)
{
  ChangedScan scan;
  CameraIntrinsics& camera = scan.changed_camera;
  const CameraIntrinsics good = camera;
  for (double* const value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy})
    *value /= 2;
  EXPECT_EQ(worst(scan, "intrinsics").severity, Severity::FAULT);
  EXPECT_CONTAINS(worst(scan, "intrinsics").what, "half the size");
  camera = good;
  camera.fx = camera.fy = 4 * good.fx;
  EXPECT_CONTAINS(worst(scan, "intrinsics").what, "field of view");
  camera = good;
  camera.fx *= 1.3;
  EXPECT_CONTAINS(worst(scan, "intrinsics").what, "pixels are square");
}

TEST(CheckRecording, ColourOfAnotherMoment)
{
  ChangedScan scan;
  scan.change = [&scan](std::size_t index, RGBDFrame& frame) {
    frame.color = scan.original((index + 21) % 24).color;
  };
  const Finding finding = worst(scan, "color_and_depth");
  EXPECT_EQ(finding.severity, Severity::FAULT);
  EXPECT_CONTAINS(finding.what, "of the colour image 3 later");
}

TEST(CheckRecording, ColourOfAnotherView)
{
  const SyntheticScan other(smallScan(9));
  ChangedScan scan;
  scan.change = [&](std::size_t index, RGBDFrame& frame) { frame.color = other.read(index).color; };
  EXPECT_CONTAINS(worst(scan, "color_and_depth").what, "do not show the same view");
}

TEST(CheckRecording, DepthThatIsNotRegistered)
{
  ChangedScan scan;
  scan.change = [](std::size_t, RGBDFrame& frame) {
    const cv::Mat original = frame.color.clone();
    original.colRange(0, 304).copyTo(frame.color.colRange(16, 320));
  };
  EXPECT_CONTAINS(worst(scan, "color_and_depth").what, "moved by 16 px across");
  scan.change = [](std::size_t, RGBDFrame& frame) {
    const cv::Mat original = frame.depth.clone();
    frame.depth.setTo(NAN);
    original.colRange(0, 270).copyTo(frame.depth.colRange(50, 320));
  };
  EXPECT_CONTAINS(worst(scan, "color_and_depth").what, "moved by -50 px across");
  EXPECT_EQ(worst(scan, "color_and_depth").severity, Severity::FAULT);
}

TEST(CheckRecording, DepthOfAnotherFieldOfView)
{
  ChangedScan scan;
  scan.change = [](std::size_t, RGBDFrame& frame) {
    const cv::Matx23d about_centre(0.8, 0, 0.1 * 319, 0, 0.8, 0.1 * 239);
    cv::warpAffine(frame.depth, frame.depth, about_centre, frame.depth.size(), cv::INTER_NEAREST);
  };
  EXPECT_EQ(worst(scan, "color_and_depth").severity, Severity::FAULT);
  EXPECT_CONTAINS(worst(scan, "color_and_depth").what, "zoomed by 1.25");
}

TEST(CheckRecording, DepthThatIsMirrored)
{
  ChangedScan scan;
  const std::pair<int, const char*> flips[] = {
      {1, "mirrored sideways"}, {0, "mirrored upside down"}, {-1, "turned by 180 degrees"}};
  for (const auto& [code, text] : flips) {
    scan.change = [code = code](std::size_t, RGBDFrame& frame) {
      cv::flip(frame.depth.clone(), frame.depth, code);
    };
    EXPECT_EQ(worst(scan, "color_and_depth").severity, Severity::FAULT);
    EXPECT_CONTAINS(worst(scan, "color_and_depth").what, text);
  }
}

TEST(CheckRecording, RepeatedImages)
{
  ChangedScan scan;
  scan.change = [&](std::size_t index, RGBDFrame& frame) {
    frame.color = scan.original(index - index % 2).color;
  };
  EXPECT_CONTAINS(worst(scan, "repeated_images").what, "12 of 23 neighbouring frames");
}

TEST(CheckRecording, RepeatedImagesBetweenTheFramesOfTheSample)
{
  struct HalfTheColorRate : SyntheticScan {
    using SyntheticScan::SyntheticScan;
    RGBDFrame
    read(std::size_t index) const override
    {
      RGBDFrame frame = SyntheticScan::read(index);
      frame.color = SyntheticScan::read(index - index % 2).color;
      return frame;
    }
  };
  SyntheticScanOptions options = smallScan();
  options.num_frames = 120; // of which every fifth is looked at
  options.frame_rate = 30;
  EXPECT_CONTAINS(worst(HalfTheColorRate(options), "repeated_images").what,
                  "neighbouring frames have the same colour image, bit for bit");
}

TEST(CheckRecording, OneFrameIsAnotherMomentUnlessItIsShort)
{
  struct LateDepth : ChangedScan {
    double
    timestamp(std::size_t index) const override
    {
      return interval * double(index);
    }
    double interval = 0.1;
  };
  LateDepth scan;
  scan.change = [&scan](std::size_t index, RGBDFrame& frame) {
    frame.depth = scan.original(std::min(index + 1, scan.size() - 1)).depth;
  };
  const auto isOfAnotherMoment = [&scan] {
    const std::vector<Finding> findings = checkRecording(scan);
    return std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
      return finding.what.find("are of other moments") != std::string::npos;
    });
  };
  EXPECT_TRUE(isOfAnotherMoment());
  scan.interval = 0.033; // what cameras do that run free
  EXPECT_FALSE(isOfAnotherMoment());
}

TEST(CheckRecording, GapsAreOfTimesOnly)
{
  struct Numbered : ChangedScan {
    double
    timestamp(std::size_t index) const override
    {
      return double(index < 12 ? index : index + 1000);
    }
    bool
    hasTimes() const override
    {
      return has_times;
    }
    bool has_times = false;
  };
  const auto numGaps = [](const RGBDDataset& dataset) {
    const std::vector<Finding> findings = checkRecording(dataset);
    return std::count_if(findings.begin(), findings.end(), [](const Finding& finding) {
      return finding.what.find("gaps") != std::string::npos;
    });
  };
  Numbered scan;
  EXPECT_EQ(numGaps(scan), 0);
  scan.has_times = true;
  EXPECT_EQ(numGaps(scan), 1);
}

TEST(CheckRecording, ColourThatStaysWhileDepthMovesOn)
{
  ChangedScan scan;
  scan.change = [&scan](std::size_t index, RGBDFrame& frame) {
    frame.color = scan.original(index - index % 3).color;
    cv::Mat noise(frame.color.size(), CV_8UC3);
    cv::theRNG().state = index + 1;
    cv::randu(noise, 0, 4); // as encoding does: the bits differ
    frame.color += noise;
  };
  EXPECT_EQ(worst(scan, "repeated_images").severity, Severity::FAULT);
  EXPECT_CONTAINS(worst(scan, "repeated_images").what, "in 16 of 23 neighbouring frames");
}

TEST(CheckRecording, DepthThatStaysWhileColourMovesOn)
{
  ChangedScan scan;
  scan.change = [&scan](std::size_t index, RGBDFrame& frame) {
    frame.depth = scan.original(index - index % 3).depth * (1 + 1e-4 * double(index));
  };
  EXPECT_EQ(worst(scan, "repeated_images").severity, Severity::FAULT);
  EXPECT_CONTAINS(worst(scan, "repeated_images").what, "the depth image stays as it was");
}

TEST(CheckRecording, DarkFramesAreCounted)
{
  ChangedScan scan;
  scan.change = [](std::size_t index, RGBDFrame& frame) {
    if (index < 16)
      frame.color.setTo(0);
  };
  EXPECT_CONTAINS(worst(scan, "frames").what, "16 of 24 frames that were looked at are dark");
}

TEST(CheckRecording, ACameraThatGoesForthAndBackOrPausesIsNoFault)
{
  ChangedScan scan;
  const auto again = [&scan](std::size_t from, std::size_t index, RGBDFrame& frame) {
    frame = scan.original(from);
    cv::theRNG().state = index + 1;
    cv::Mat noise(frame.color.size(), CV_8UC3), depth_noise(frame.depth.size(), CV_32FC1);
    cv::randu(noise, 0, 3);
    cv::randn(depth_noise, 1, 0.002);
    frame.color += noise;
    frame.depth = frame.depth.mul(depth_noise);
  };
  scan.change = [&again](std::size_t index, RGBDFrame& frame) {
    const std::size_t phase = index % 12;
    again(phase < 6 ? phase : 11 - phase, index, frame);
  };
  EXPECT_EQ(worst(scan, "color_and_depth").what, "");
  EXPECT_EQ(worst(scan, "repeated_images").what, "");
  scan.change = [&again](std::size_t index, RGBDFrame& frame) {
    again(std::min<std::size_t>(index, 14), index, frame);
  };
  EXPECT_EQ(worst(scan, "color_and_depth").what, "");
  EXPECT_EQ(worst(scan, "repeated_images").what, "");
}

TEST(CheckRecording, DoesNotDependOnThreads)
{
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "takes minutes under sanitizers; other tests run the same code";
#endif
  const SyntheticScan scan(smallScan());
  CheckOptions one, several;
  one.num_threads = 1;
  several.num_threads = 4;
  const auto a = checkRecording(scan, one), b = checkRecording(scan, several);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_EQ(toString(a[i]), toString(b[i]));
  one.num_frames = 1;
  EXPECT_THROW(checkRecording(scan, one), pcl::BadArgumentException);
}

TEST(CheckRecording, NumbersThatAreNoDepth)
{
  ChangedScan scan;
  const auto say = [&scan](const std::function<float(float, double, double)>& rule) {
    scan.change = [&scan, rule](std::size_t, RGBDFrame& frame) {
      const CameraIntrinsics& camera = scan.camera();
      for (int v = 0; v < frame.depth.rows; ++v)
        for (int u = 0; u < frame.depth.cols; ++u) {
          float& z = frame.depth.at<float>(v, u);
          z = rule(z, (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
        }
    };
    const Finding finding = worst(scan, "depth_numbers");
    EXPECT_EQ(finding.severity, Severity::FAULT);
    return finding.what;
  };
  EXPECT_CONTAINS(say([](float z, double, double) { return 0.05f * std::round(z / 0.05f); }),
                  "depth comes in steps of 0.05 m");
  EXPECT_CONTAINS(say([](float z, double, double) { return z > 1.2f ? 1.2f : z; }), "was clipped");
  EXPECT_CONTAINS(say([](float z, double, double) { return 2 / z; }), "inverse depth");
  EXPECT_CONTAINS(
      say([](float z, double x, double y) { return float(z * std::sqrt(1 + x * x + y * y)); }),
      "lengths of rays");
  EXPECT_CONTAINS(say([](float z, double x, double y) { // several threads read: no generator
                    const double number = 43758.5 * std::sin(12345.6 * x + 54321.9 * y);
                    return z * float(1 + 2 * (number - std::floor(number)));
                  }),
                  "is noise");
}

TEST(CheckRecording, DepthOfRandomFrames)
{
  ChangedScan scan;
  scan.change = [&scan](std::size_t index, RGBDFrame& frame) {
    frame.depth = scan.original(index * 7 % 24).depth;
  };
  const Finding finding = worst(scan, "color_and_depth");
  EXPECT_EQ(finding.severity, Severity::FAULT);
  EXPECT_CONTAINS(finding.what, "do not show the same view");
}
