// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// Faults that are put into simulated scans, and what checkRecording() says of them.
#include <bundle_icp/scan/check.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "messages.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <functional>

using namespace bundle_icp;

namespace {

SyntheticScanOptions
smallScan(std::uint64_t seed = 1)
{
  SyntheticScanOptions options = SyntheticScanOptions::fullNoise();
  options.num_frames = 24;
  options.frame_rate = 5;
  options.width = 320;
  options.height = 240;
  options.focal_length = 262;
  options.seed = seed;
  return options;
}

/** A scan whose frames and camera a test changes. */
class ChangedScan : public RGBDDataset {
public:
  explicit ChangedScan(const SyntheticScanOptions& options = smallScan())
  : scan(options), changed_camera(scan.camera())
  {
  }

  std::size_t
  size() const override
  {
    return scan.size();
  }
  const CameraIntrinsics&
  camera() const override
  {
    return changed_camera;
  }
  std::size_t
  id(std::size_t index) const override
  {
    return index;
  }
  double
  timestamp(std::size_t index) const override
  {
    return scan.timestamp(index);
  }
  std::string
  name(std::size_t index) const override
  {
    return scan.name(index);
  }
  RGBDFrame
  read(std::size_t index) const override
  {
    RGBDFrame frame = scan.read(index);
    if (change)
      change(index, frame);
    return frame;
  }

  SyntheticScan scan;
  CameraIntrinsics changed_camera;
  std::function<void(std::size_t, RGBDFrame&)> change;
};

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
    frame.color = scan.scan.read((index + 21) % 24).color;
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
    cv::Mat moved = frame.color.clone();
    frame.color.colRange(0, 304).copyTo(moved.colRange(16, 320));
    frame.color = moved;
  };
  EXPECT_CONTAINS(worst(scan, "color_and_depth").what, "about 16 px beside");
}

TEST(CheckRecording, RepeatedImages)
{
  ChangedScan scan;
  scan.change = [&](std::size_t index, RGBDFrame& frame) {
    frame.color = scan.scan.read(index - index % 2).color;
  };
  EXPECT_CONTAINS(worst(scan, "repeated_images").what, "12 of 23 neighbouring frames");
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

TEST(CheckRecording, DoesNotDependOnThreads)
{
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
