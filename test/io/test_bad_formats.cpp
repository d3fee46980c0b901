// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What happens to recordings with faults in formats that bundle_icp_simulate writes.
#include <bundle_icp/io/rgbd_dataset.h>
#include <bundle_icp/simulation/synthetic_scan.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>
#include <pcl/io/pcd_io.h>

using namespace bundle_icp;
namespace fs = boost::filesystem;

namespace {

std::string
openError(const std::string& path, const DatasetOptions& options = {})
{
  return messageOf<pcl::IOException>([&] { openDataset(path, options); });
}

/** Replaces a part of a text file. */
void
replace(const std::string& path, const std::string& part, const std::string& by)
{
  std::string text = readText(path);
  const std::size_t at = text.find(part);
  ASSERT_NE(at, std::string::npos) << path << " has no " << part;
  writeText(path, text.replace(at, part.size(), by));
}

const Finding*
findingOf(const RGBDDataset& dataset, const std::string& kind, const std::string& text)
{
  static std::vector<Finding> findings;
  findings = dataset.findings();
  for (const Finding& finding : findings)
    if (finding.kind == kind && finding.what.find(text) != std::string::npos)
      return &finding;
  return nullptr;
}

class BadFormat : public ::testing::Test {
protected:
  /** Writes a scan of three frames. */
  void
  write(const std::string& format)
  {
    SyntheticScanOptions scan;
    scan.num_frames = 3;
    scan.width = 64;
    scan.height = 48;
    scan.focal_length = 55;
    SyntheticScanWriteOptions options;
    options.format = format;
    options.surface_spacing = 0;
    options.num_threads = 1;
    writeSyntheticScan(SyntheticScan(scan), place, options);
  }

  TemporaryFolder folder;
  std::string place = folder.path("scan");
};

/** Opens a recording and reads all of it; faults may be refused, and nothing else may happen. */
void
readAll(const std::string& path)
{
  try {
    const auto dataset = openDataset(path);
    for (std::size_t i = 0; i < dataset->size(); ++i)
      try {
        dataset->read(i);
      }
      catch (const pcl::IOException&) {
      }
  }
  catch (const pcl::IOException&) {
  }
  catch (const pcl::BadArgumentException&) { // impossible intrinsics
  }
}

/** Cuts a file off at many places, and changes bytes of it at random. */
void
damage(const std::string& recording, const std::string& file)
{
  const std::string whole = readText(file);
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 40) {
    writeText(file, whole.substr(0, size));
    readAll(recording);
  }
  cv::RNG random(1);
  for (int repetition = 0; repetition < 150; ++repetition) {
    std::string damaged = whole;
    // Half of the changes are where sizes stand.
    const int range = repetition % 2 ? int(whole.size()) : std::min(600, int(whole.size()));
    for (int k = random.uniform(1, 4); k > 0; --k)
      damaged[std::size_t(random.uniform(0, range))] = char(random.uniform(0, 256));
    writeText(file, damaged);
    readAll(recording);
  }
  writeText(file, whole);
  readAll(recording);
}

} // namespace

TEST_F(BadFormat, UnknownFoldersAreToldWhatWouldWork)
{
  writeText(place + "/notes.txt", "nothing");
  const std::string message = openError(place);
  EXPECT_CONTAINS(message, "scan: unknown format. Looked for:\n  TUM RGB-D: rgb.txt and depth.txt");
  EXPECT_CONTAINS(message, "\n  ScanNet: one file x.sens\n");
  EXPECT_CONTAINS(message, place + "/color/000000.png");
  EXPECT_CONTAINS(message, place + "/intrinsics.txt with the line: fx fy cx cy");
  EXPECT_CONTAINS(message, "bundle_icp_reconstruct " + place + " -o result");
  EXPECT_CONTAINS(openError(place + "/notes.txt"), "is not a folder, and no recording in one file");
}

TEST_F(BadFormat, ListsOfOtherSystems)
{
  write("associations");
  fs::rename(place + "/rgb", place + "/colour images");
  std::string list = "\xef\xbb\xbf# from Windows\r\n";
  for (int i = 0; i < 3; ++i)
    list += "0." + std::to_string(i) + "\tdepth\\" + std::to_string(i) + ".png 0." +
            std::to_string(i) + "  colour images\\" + std::to_string(i) + ".png\r\n";
  writeText(place + "/associations.txt", list);
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->size(), 3u);
  EXPECT_TRUE(dataset->skipped().empty());
  writeText(place + "/associations.txt", "0 rgb/0.png\n");
  EXPECT_CONTAINS(openError(place), "associations.txt:1: expected TIME IMAGE TIME IMAGE");
}

TEST_F(BadFormat, NegativeFocalLengthOfIclNuim)
{
  write("associations");
  const Trajectory truth = openDataset(place)->groundTruth();
  replace(place + "/intrinsics.txt", "55 55", "55 -55");
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->camera().fy, 55);
  EXPECT_TRUE(findingOf(*dataset, "intrinsics", "y points upwards"));
  const Eigen::Matrix4d mirror = Eigen::Vector4d(1, -1, 1, 1).asDiagonal();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Matrix4d expected = mirror * truth[i].world_from_camera.matrix() * mirror;
    EXPECT_TRUE(dataset->groundTruth()[i].world_from_camera.matrix().isApprox(expected, 1e-12));
  }
}

TEST_F(BadFormat, OneFolderTellsStreamsApartByWords)
{
  for (int i = 1; i < 4; ++i) {
    const std::string name = folder.path("a/" + std::to_string(i));
    recordings::writeImage(name + ".png", recordings::color(i));
    recordings::writeImage(name + "_depth.png", recordings::depth(1000 + i));
    const std::string other = folder.path("b/" + std::to_string(i));
    recordings::writeImage(other + "-Color.jpg", recordings::color(i));
    recordings::writeImage(other + "-Depth.png", recordings::depth(1000 + i));
    recordings::writeImage(other + "-mask.png", recordings::depth(1));
  }
  for (const std::string name : {"a", "b"}) {
    writeText(folder.path(name + "/intrinsics.txt"), "60 60 32 24");
    const auto dataset = openDataset(folder.path(name));
    ASSERT_EQ(dataset->size(), 3u) << name;
    EXPECT_EQ(dataset->id(2), 3u);
    EXPECT_FLOAT_EQ(dataset->read(2).depth.at<float>(0, 0), 1.003f);
  }
  // Images of one kind alone are no recording.
  recordings::writeImage(folder.path("c/color1.png"), recordings::color(1));
  EXPECT_CONTAINS(openError(folder.path("c")), "unknown format");
}

TEST_F(BadFormat, StrayScanner)
{
  write("stray-scanner");
  const auto depth = openDataset(place)->read(1).depth;
  cv::Mat confidence(48, 64, CV_8UC1, cv::Scalar(1));
  confidence(cv::Rect(0, 0, 32, 48)) = 0;
  recordings::writeImage(place + "/confidence/000001.png", confidence);
  const auto dataset = openDataset(place);
  EXPECT_TRUE(findingOf(*dataset, "confidence", "3 of 3 frames"));
  EXPECT_TRUE(findingOf(*dataset, "poses", "the device (ARKit) estimated"));
  const cv::Mat left_out = dataset->read(1).depth;
  EXPECT_EQ(cv::countNonZero(left_out(cv::Rect(0, 0, 32, 48)) > 0), 0);
  EXPECT_EQ(cv::countNonZero(left_out(cv::Rect(32, 0, 32, 48)) > 0),
            cv::countNonZero(depth(cv::Rect(32, 0, 32, 48)) > 0));

  recordings::writeImage(place + "/confidence/000001.png", confidence.rowRange(0, 7));
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place)->read(1); }),
                  "confidence/000001.png: the confidence must have");
  replace(place + "/odometry.csv", "000002", "000009");
  EXPECT_EQ(openDataset(place)->size(), 2u);
  EXPECT_CONTAINS(openDataset(place)->skipped().at(0).reason, "has no line in");
  writeText(place + "/odometry.csv", "timestamp, frame\n1, 0\n");
  EXPECT_CONTAINS(openError(place), "odometry.csv:2: expected timestamp, frame, x, y, z");
  writeText(place + "/odometry.csv", "1, 0, 0, 0, 0, 0, 0, 0, 2\n");
  EXPECT_CONTAINS(openError(place), "odometry.csv:1: the quaternion is not of unit length");
  writeText(place + "/camera_matrix.csv", "1,2,3");
  writeText(place + "/odometry.csv", "1, 0, 0, 0, 0, 0, 0, 0, 1\n");
  EXPECT_CONTAINS(openError(place), "camera_matrix.csv: 3 numbers; expected 9");
  fs::remove_all(place + "/rgb");
  EXPECT_CONTAINS(openError(place), "ffmpeg -i " + place + "/rgb.mp4");
}

TEST_F(BadFormat, Nerfstudio)
{
  write("nerfstudio");
  const std::string file = place + "/transforms.json", whole = readText(file);
  EXPECT_EQ(openDataset(file)->size(), 3u); // the file stands for its folder
  replace(file, "\"OPENCV\"", "\"OPENCV_FISHEYE\"");
  EXPECT_CONTAINS(openError(place), "transforms.json: camera model OPENCV_FISHEYE is unknown");
  writeText(file, whole);
  replace(file, "\"fl_x\"", "\"focal\"");
  EXPECT_CONTAINS(openError(place), "intrinsics are unknown (nerfstudio recording");
  writeText(file, whole);
  replace(file, "\"w\": 64", "\"w\": -4");
  EXPECT_CONTAINS(openError(place), "w is no size of an image");
  writeText(file, whole);
  replace(file, "\"cx\"", "\"k1\": 0.1, \"cx\"");
  EXPECT_TRUE(findingOf(*openDataset(place), "intrinsics", "with distortion"));
  writeText(file, whole);
  fs::remove(place + "/depth/frame_000001.png");
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->size(), 2u);
  EXPECT_EQ(dataset->skipped().at(0).reason, "named in transforms.json but absent");
  writeText(file, "{\"frames\": 3, \"depth_file_path\": 1}");
  EXPECT_CONTAINS(openError(place), "transforms.json: is not of the form that was expected");
  writeText(file, whole);
  damage(place, file);
}

TEST_F(BadFormat, Polycam)
{
  write("polycam");
  const std::string file = place + "/keyframes/cameras/0.json", whole = readText(file);
  EXPECT_EQ(openDataset(place + "/keyframes")->size(), 3u);
  replace(file, "\"fx\": 55", "\"fx\": 57");
  const Finding* const finding = findingOf(*openDataset(place), "intrinsics", "its own intrinsics");
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->severity, Severity::WARNING); // 4 %
  EXPECT_NEAR(openDataset(place)->camera().fx, 55, 1e-9);
  writeText(file, whole);
  replace(file, "t_00", "t_99");
  EXPECT_CONTAINS(openError(place), "0.json: is not of the form that was expected");
  fs::remove(file);
  EXPECT_EQ(openDataset(place)->groundTruth().size(), 2u);
  EXPECT_CONTAINS(openDataset(place)->skipped().at(0).reason, "the frame has no pose");
}

TEST_F(BadFormat, ScanNetExport)
{
  write("scannet");
  writeText(place + "/pose/1.txt",
            "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n0 0 0 1\n");
  EXPECT_EQ(openDataset(place)->groundTruth().size(), 2u);
  replace(place + "/intrinsic/extrinsic_depth.txt", "1 0 0 0", "1 0 0 0.1");
  EXPECT_CONTAINS(openError(place), "extrinsic_depth.txt: is not the identity");
  fs::remove(place + "/intrinsic/extrinsic_depth.txt");
  writeText(place + "/intrinsic/intrinsic_color.txt", "55 0 32\n");
  EXPECT_CONTAINS(openError(place), "intrinsic_color.txt: 3 numbers; expected 16");
}

TEST_F(BadFormat, Sens)
{
  write("sens");
  const std::string file = place + "/scan.sens", whole = readText(file);
  EXPECT_EQ(openDataset(file)->size(), 3u);
  EXPECT_EQ(openDataset(file)->name(1), file + "/1");
  writeText(file, whole.substr(0, whole.size() - 100)); // within the last frame
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->size(), 2u);
  EXPECT_TRUE(findingOf(*dataset, "frames", "is cut off: it holds 2 of 3 frames"));
  writeText(file, whole.substr(0, 100));
  EXPECT_CONTAINS(openError(place), "scan.sens: the file is cut off");
  writeText(file, "\x03" + whole.substr(1));
  EXPECT_CONTAINS(openError(place), "version 3 of the .sens format; only 4 is known");
  writeText(file, whole);
  damage(place, file);
}

TEST_F(BadFormat, PclReadsAndWritesTheSameClouds)
{
  write("pcd");
  const std::string file = place + "/cloud0001.pcd";
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(file, cloud), 0);
  ASSERT_EQ(cloud.width, 64u);
  const RGBDFrame frame = openDataset(place)->read(1);
  EXPECT_FLOAT_EQ(cloud.at(20, 30).z, frame.depth.at<float>(30, 20));
  EXPECT_EQ(cloud.at(20, 30).r, frame.color.at<cv::Vec3b>(30, 20)[2]);
  const auto same = [&frame](const RGBDFrame& other) {
    return cv::norm(frame.color, other.color, cv::NORM_INF) == 0 &&
           cv::norm(frame.depth, other.depth, cv::NORM_INF) < 1e-6;
  };
  pcl::io::savePCDFileASCII(file, cloud);
  EXPECT_TRUE(same(openDataset(place)->read(1)));
  pcl::io::savePCDFileBinaryCompressed(file, cloud);
  EXPECT_TRUE(same(openDataset(place)->read(1)));
  damage(place, file);
  pcl::io::savePCDFileASCII(file, cloud);
  damage(place, file);
}

TEST_F(BadFormat, Pcd)
{
  write("pcd");
  fs::remove(place + "/cloud0001.pcd");
  fs::remove(place + "/cloud0002.pcd");
  const std::string file = place + "/cloud0000.pcd", whole = readText(file);
  replace(file, "HEIGHT 48", "HEIGHT 1");
  EXPECT_CONTAINS(openError(place), "cloud0000.pcd: the cloud is not organized");
  writeText(file, whole);
  replace(file, "HEIGHT 48", "HEIGHT 60000");
  EXPECT_CONTAINS(openError(place), "cloud0000.pcd: the file is cut off");
  writeText(file, whole);
  replace(file, "FIELDS x y z rgb", "FIELDS x y z curvature");
  EXPECT_CONTAINS(openError(place), "cloud0000.pcd: has no field rgb");
  writeText(file, whole);
  replace(file, "FIELDS x y z rgb", "FIELDS x z y rgb"); // another frame
  EXPECT_CONTAINS(openError(place), "are not those of a camera that looks along z");
  writeText(file, "this is no cloud");
  EXPECT_CONTAINS(openError(place), "is no PCD file: its header has no line DATA");
}

TEST_F(BadFormat, FloatsAreMetresWhateverTheFormatSays)
{
  write("open3d");
  for (const std::string extension : {".tiff", ".exr"}) {
    fs::remove_all(place + "/depth");
    cv::Mat depth(48, 64, CV_32FC1, cv::Scalar(1.25));
    depth.at<float>(3, 4) = std::numeric_limits<float>::quiet_NaN();
    depth.at<float>(5, 6) = 0;
    setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 1); // for writing
    for (int i = 0; i < 3; ++i) {
      depth.at<float>(0, 0) = float(i); // images that are equal are left out
      recordings::writeImage(place + "/depth/" + std::to_string(i) + extension, depth);
    }
    const auto dataset = openDataset(place);
    EXPECT_TRUE(findingOf(*dataset, "units", "1 units per metre, from the depth images"));
    const RGBDFrame frame = dataset->read(1);
    EXPECT_EQ(frame.depth.at<float>(10, 10), 1.25f);
    EXPECT_TRUE(std::isnan(frame.depth.at<float>(3, 4)));
    EXPECT_TRUE(std::isnan(frame.depth.at<float>(5, 6)));
    DatasetOptions options;
    options.depth_scale = 2;
    EXPECT_EQ(openDataset(place, options)->read(1).depth.at<float>(10, 10), 0.625f);
  }
}

TEST_F(BadFormat, GreyColourAndOtherKindsOfDepth)
{
  write("open3d");
  for (const std::string extension : {".pgm", ".tif"}) {
    fs::remove_all(place + "/depth");
    fs::remove_all(place + "/color");
    for (int i = 0; i < 3; ++i) {
      recordings::writeImage(place + "/color/" + std::to_string(i) + ".pgm",
                             cv::Mat(48, 64, CV_8UC1, cv::Scalar(40 + i)));
      recordings::writeImage(place + "/depth/" + std::to_string(i) + extension,
                             recordings::depth(1250));
    }
    const RGBDFrame frame = openDataset(place)->read(1);
    EXPECT_EQ(frame.color.at<cv::Vec3b>(3, 4), cv::Vec3b(41, 41, 41));
    EXPECT_EQ(frame.depth.at<float>(3, 4), 1.25f);
  }
}
