// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// A scan that is written in the format of a recorder and read again is the same.
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "temporary_folder.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;

namespace {

/** What a format keeps. */
struct Format {
  friend std::ostream&
  operator<<(std::ostream& stream, const Format& format)
  {
    return stream << format.name;
  }

  const char* name;    ///< of SyntheticScanWriteOptions
  const char* read_as; ///< RGBDDataset::format()
  double units;        ///< of depth per metre
  bool has_times, has_poses;
  double color_error = 0; ///< mean of the levels; above 0 for JPEG
};

constexpr double JPEG = 4;

class RecordingFormat : public ::testing::TestWithParam<Format> {
protected:
  static SyntheticScan
  scan()
  {
    SyntheticScanOptions options;
    options.num_frames = 4;
    options.width = 96;
    options.height = 72;
    options.focal_length = 80;
    options.hole_fraction = 0.1;
    options.start_time = 2;
    return SyntheticScan(options);
  }

  /** Depth of a frame in the units of a format. */
  static cv::Mat
  rounded(const cv::Mat& depth, double units)
  {
    cv::Mat measured = depth.clone(), rounded, result;
    measured.setTo(0, depth != depth);
    measured.convertTo(rounded, CV_16UC1, units);
    result.create(depth.size(), CV_32FC1);
    std::transform(rounded.begin<std::uint16_t>(), rounded.end<std::uint16_t>(),
                   result.begin<float>(), [&](int number) { return float(number) / float(units); });
    return result;
  }
};

double
meanDifference(const cv::Mat& a, const cv::Mat& b)
{
  return cv::norm(a, b, cv::NORM_L1) / double(a.total() * std::size_t(a.channels()));
}

} // namespace

TEST_P(RecordingFormat, IsReadAsItWasWritten)
{
  const Format& format = GetParam();
  const SyntheticScan written = scan();
  const TemporaryFolder folder;
  SyntheticScanWriteOptions options;
  options.format = format.name;
  options.surface_spacing = 0;
  writeSyntheticScan(written, folder.path("scan"), options);

  const auto dataset = openDataset(folder.path("scan"));
  EXPECT_EQ(dataset->format(), format.read_as);
  EXPECT_TRUE(dataset->skipped().empty());
  ASSERT_EQ(dataset->size(), written.size());
  const CameraIntrinsics &camera = dataset->camera(), &true_camera = written.camera();
  EXPECT_NEAR(camera.fx, true_camera.fx, 1e-4);
  EXPECT_NEAR(camera.fy, true_camera.fy, 1e-4);
  EXPECT_NEAR(camera.cx, true_camera.cx, 1e-4);
  EXPECT_NEAR(camera.cy, true_camera.cy, 1e-4);
  EXPECT_EQ(dataset->hasTimes(), format.has_times);
  const Trajectory poses = dataset->groundTruth();
  ASSERT_EQ(poses.size(), format.has_poses ? written.size() : 0);
  for (std::size_t i = 0; i < written.size(); ++i) {
    const RGBDFrame read = dataset->read(i), frame = written.read(i);
    EXPECT_EQ(read.id, i);
    EXPECT_NEAR(read.timestamp, format.has_times ? frame.timestamp : double(i) / 30, 1e-6);
    EXPECT_LE(meanDifference(read.color, frame.color), format.color_error);
    cv::Mat depth = read.depth.clone();
    depth.setTo(0, read.depth != read.depth);
    EXPECT_EQ(cv::norm(depth, rounded(frame.depth, format.units), cv::NORM_INF), 0);
    if (!poses.empty()) {
      EXPECT_EQ(poses[i].timestamp, read.timestamp);
      EXPECT_TRUE(poses[i].world_from_camera.isApprox(written.worldFromCamera(i), 1e-6));
    }
  }
}

TEST_P(RecordingFormat, UsesEachOfItsFiles)
{
  const TemporaryFolder folder;
  SyntheticScanWriteOptions options;
  options.format = GetParam().name;
  options.surface_spacing = 0;
  writeSyntheticScan(scan(), folder.path(), options);
  for (const Finding& finding : openDataset(folder.path())->findings())
    EXPECT_NE(finding.kind, "unused_files") << finding.what;
}

TEST(RecordingFormats, DepthOfAnotherSizeIsThatOfAnyFormat)
{
  SyntheticScanOptions options;
  options.num_frames = 2;
  options.width = 128;
  options.height = 96;
  options.focal_length = 105;
  options.depth_width = 64;
  options.depth_height = 48;
  const SyntheticScan same_view(options);
  options.depth_focal_length = 45;
  const SyntheticScan other_lens(options);
  const auto read = [](const SyntheticScan& scan, const std::string& format) {
    const TemporaryFolder folder;
    SyntheticScanWriteOptions write;
    write.format = format;
    write.surface_spacing = 0;
    writeSyntheticScan(scan, folder.path(), write);
    return openDataset(folder.path())->read(1).depth;
  };
  const auto areEqual = [](const cv::Mat& a, const cv::Mat& b) {
    return cv::countNonZero((a == a) != (b == b)) == 0 &&
           cv::norm(a, b, cv::NORM_INF, a == a) < 1e-5;
  };
  const cv::Mat expected = read(same_view, "images"), expected_other = read(other_lens, "images");
  EXPECT_EQ(expected.size(), cv::Size(128, 96));
  EXPECT_GT(cv::countNonZero(expected > 0), 128 * 96 / 2);
  for (const char* const format :
       {"open3d", "stray-scanner", "polycam", "nerfstudio", "scannet", "sens"})
    EXPECT_TRUE(areEqual(read(same_view, format), expected)) << format;
  for (const char* const format : {"scannet", "sens"})
    EXPECT_TRUE(areEqual(read(other_lens, format), expected_other)) << format;
  for (const char* const format : {"open3d", "pcd"})
    EXPECT_THROW(read(other_lens, format), pcl::BadArgumentException) << format;
}

TEST(RecordingFormats, ScanNetsOlderExportKeepsTheSizeOfColour)
{
  SyntheticScanOptions options;
  options.num_frames = 2;
  options.width = 128;
  options.height = 96;
  options.focal_length = 105;
  options.depth_width = 64;
  options.depth_height = 48;
  options.depth_focal_length = 45;
  const TemporaryFolder folder;
  SyntheticScanWriteOptions write;
  write.format = "scannet";
  write.surface_spacing = 0;
  writeSyntheticScan(SyntheticScan(options), folder.path("new"), write);
  for (const std::string number : {"0", "1"})
    for (const auto& [old, name] :
         {std::pair<std::string, std::string>("color/" + number + ".jpg", ".color.jpg"),
          {"depth/" + number + ".png", ".depth.png"}})
      writeText(folder.path("old/frame-00000" + number + name),
                readText(folder.path("new/" + old)));
  writeText(folder.path("old/_info.txt"),
            "m_versionNumber = 4\nm_sensorName = StructureSensor\nm_colorWidth = 128\n"
            "m_colorHeight = 96\nm_depthWidth = 64\nm_depthHeight = 48\nm_depthShift = 1000\n"
            "m_calibrationColorIntrinsic = 105 0 63.5 0 0 105 47.5 0 0 0 1 0 0 0 0 1\n"
            "m_calibrationDepthIntrinsic = 45 0 31.5 0 0 45 23.5 0 0 0 1 0 0 0 0 1\n");
  const cv::Mat depth = openDataset(folder.path("old"))->read(1).depth;
  const cv::Mat expected = openDataset(folder.path("new"))->read(1).depth;
  EXPECT_EQ(depth.size(), cv::Size(128, 96));
  EXPECT_EQ(cv::norm(depth, expected, cv::NORM_INF, expected == expected), 0);
}

INSTANTIATE_TEST_SUITE_P(
    All, RecordingFormat,
    ::testing::Values(Format{"tum", "TUM RGB-D", 5000, true, true},
                      Format{"associations", "TUM RGB-D", 5000, true, true},
                      Format{"7-scenes", "7-Scenes", 1000, false, true},
                      Format{"scannet", "ScanNet", 1000, false, true, JPEG},
                      Format{"open3d", "Open3D", 1000, false, false},
                      Format{"images", "images in one folder", 1000, false, false},
                      Format{"stray-scanner", "Stray Scanner", 1000, true, true},
                      Format{"nerfstudio", "nerfstudio", 1000, false, true},
                      Format{"polycam", "Polycam", 1000, true, true, JPEG},
                      Format{"pcd", "PCL point clouds", 1000, false, true},
                      Format{"sens", "ScanNet .sens", 1000, true, true}),
    [](const auto& test) {
      std::string name = test.param.name;
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });
