// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What happens to clouds, files of whole recordings and unusual images with faults.
#include "bad_format.h"

#include <pcl/io/pcd_io.h>

#include <sys/stat.h>

using namespace bundle_icp;
using namespace bad_format;
namespace fs = boost::filesystem;

using BadContainer = BadFormat;

TEST_F(BadContainer, Sens)
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
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_CONTAINS(openError(place), "scan.sens: is a folder, not a file");
  fs::remove(file);
  writeText(file, whole);
  damage(place, file);
}

TEST_F(BadContainer, PclReadsAndWritesTheSameClouds)
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

TEST_F(BadContainer, BytesInBetweenDoNotMovePoints)
{
  write("pcd");
  const std::string file = place + "/cloud0001.pcd", whole = readText(file);
  writeText(file, whole + "\n");
  EXPECT_EQ(openDataset(place)->read(1).id, 1u);
  std::string longer = whole;
  longer.insert(whole.size() / 2, 16, '\x3f');
  writeText(file, longer);
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(place)->read(1); }),
                  "cloud0001.pcd: the file holds more data than its header says");
}

TEST_F(BadContainer, APipeAmongCloudsIsNotWaitedFor)
{
  write("pcd");
  fs::remove(place + "/cloud0001.pcd");
  ASSERT_EQ(mkfifo((place + "/cloud0001.pcd").c_str(), 0600), 0);
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("55,55,31.5,23.5"); // no cloud is read for them
  const auto dataset = openDataset(place, options);
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(1); }),
                  "cloud0001.pcd: is not a regular file");
  EXPECT_FALSE(dataset->read(2).depth.empty());
}

TEST_F(BadContainer, Pcd)
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

TEST_F(BadContainer, FloatsAreMetresWhateverTheFormatSays)
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

TEST_F(BadContainer, GreyColourAndOtherKindsOfDepth)
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
