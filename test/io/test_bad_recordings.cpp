// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What happens to recordings with faults.
#include <bundle_icp/io/rgbd_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;

namespace {

std::string
openError(const std::string& path, const DatasetOptions& options = {})
{
  return messageOf<pcl::IOException>([&] { openDataset(path, options); });
}

class BadRecording : public ::testing::Test {
protected:
  void
  SetUp() override
  {
    recordings::writeTum(place, 3);
  }

  TemporaryFolder folder;
  std::string place = folder.path("scan");
};

} // namespace

TEST_F(BadRecording, FolderMissingEmptyOrUnknown)
{
  EXPECT_CONTAINS(openError(folder.path("absent")), "absent: no such folder");
  EXPECT_CONTAINS(openError(place + "/rgb.txt"), "rgb.txt: is not a folder");
  boost::filesystem::create_directories(folder.path("empty"));
  EXPECT_CONTAINS(openError(folder.path("empty")), "empty: the folder is empty");
  EXPECT_CONTAINS(openError(folder.path()), "unknown format, but its folder " + place + " (TUM");
}

TEST_F(BadRecording, ListsWithFaults)
{
  writeText(place + "/rgb.txt", "# nothing\n");
  EXPECT_CONTAINS(openError(place), "rgb.txt: lists no image");
  writeText(place + "/rgb.txt", "0.0 rgb/x.png\n0.1 rgb/y.png");
  EXPECT_CONTAINS(openError(place), "none of the 2 listed images exists");
  writeText(place + "/rgb.txt", "0.0 rgb/0.png\n\n0.1\n");
  EXPECT_CONTAINS(openError(place), "rgb.txt:3: expected a time stamp and a file name");
  writeText(place + "/rgb.txt", "rgb/0.png 0.0");
  EXPECT_CONTAINS(openError(place), "rgb.txt:1: 'rgb/0.png' is not a number");
}

TEST_F(BadRecording, ListMissing)
{
  boost::filesystem::remove(place + "/depth.txt");
  EXPECT_CONTAINS(openError(place), "depth.txt: cannot be opened: No such file");
}

TEST_F(BadRecording, NoOverlapInTime)
{
  writeText(place + "/depth.txt", "100.0 depth/0.png\n100.1 depth/1.png");
  const std::string message = openError(place);
  EXPECT_CONTAINS(message, "scan: no overlap in time");
  EXPECT_CONTAINS(message, "100.000000 to 100.100000 s");
}

TEST_F(BadRecording, EightBitDepth)
{
  for (int i = 0; i < 3; ++i)
    recordings::writeImage(place + "/depth/" + std::to_string(i) + ".png",
                           cv::Mat(48, 64, CV_8UC1, cv::Scalar(9)));
  EXPECT_CONTAINS(openError(place), "depth/0.png: 8-bit depth");
}

TEST_F(BadRecording, ColourImageInPlaceOfDepth)
{
  writeText(place + "/depth.txt", "0 rgb/0.png\n0.1 rgb/1.png");
  EXPECT_CONTAINS(openError(place), "rgb/0.png: a colour image where depth is expected");
}

TEST_F(BadRecording, DepthImageInPlaceOfColour)
{
  writeText(place + "/rgb.txt", "0 depth/0.png\n0.1 depth/1.png");
  EXPECT_CONTAINS(openError(place), "depth/0.png: more than 8 bits a channel");
}

TEST_F(BadRecording, SizesThatDiffer)
{
  for (int i = 0; i < 3; ++i)
    recordings::writeImage(place + "/depth/" + std::to_string(i) + ".png",
                           recordings::depth(5000, {32, 32}));
  const std::string message = openError(place);
  EXPECT_CONTAINS(message, "depth/0.png: depth of 32x32");
  EXPECT_CONTAINS(message, "has 64x48");
  EXPECT_CONTAINS(message, "--depth-intrinsics fx,fy,cx,cy");
  EXPECT_CONTAINS(message, "--depth-to-color FILE");
}

TEST_F(BadRecording, ImagesNotOfTheSizeOfTheIntrinsics)
{
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("60,60,32,24");
  options.intrinsics->width = 128;
  options.intrinsics->height = 96;
  const std::string message = openError(place, options);
  EXPECT_CONTAINS(message, "rgb/0.png: image of 64x48");
  EXPECT_CONTAINS(message, "(from the options) are for 128x96");
}

TEST_F(BadRecording, ImpossibleOrUnknownIntrinsics)
{
  DatasetOptions options;
  for (const char* const text : {"0,60,32,24", "-60,60,32,24", "60,60,200,24", "1e9,60,32,24"}) {
    options.intrinsics = parseIntrinsics(text);
    EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { openDataset(place, options); }),
                    "impossible camera intrinsics")
        << text;
  }
  writeText(place + "/intrinsics.txt", "60 60 32\n");
  EXPECT_CONTAINS(openError(place), "intrinsics.txt:1: expected fx fy cx cy");
  writeText(place + "/intrinsics.txt", "60 60 32 24\ndepth_scale 0\n");
  EXPECT_CONTAINS(openError(place), "intrinsics.txt:2: expected");
  writeText(place + "/intrinsics.txt", "# nothing\n");
  EXPECT_CONTAINS(openError(place), "scan: the camera's intrinsics are unknown");
  boost::filesystem::remove(place + "/intrinsics.txt");
  EXPECT_CONTAINS(openError(place), "--intrinsics fx,fy,cx,cy");
}

TEST_F(BadRecording, CorruptFirstFrameDoesNotFailTheRecording)
{
  writeText(place + "/rgb/0.png", "this is not an image");
  writeText(place + "/depth/1.png", "");
  const auto dataset = openDataset(place);
  ASSERT_EQ(dataset->size(), 3u);
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }),
                  "rgb/0.png: cannot be decoded");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(1); }),
                  "depth/1.png: the file is empty");
  EXPECT_EQ(dataset->read(2).id, 2u);
}

TEST_F(BadRecording, UnsuitableFirstFrameDoesNotFailTheRecording)
{
  recordings::writeImage(place + "/rgb/0.png", recordings::color(0, {100, 100}));
  recordings::writeImage(place + "/rgb/2.png", recordings::color(0, {32, 24}));
  recordings::writeImage(place + "/depth/2.png", recordings::depth(5000, {32, 24}));
  const auto dataset = openDataset(place);
  EXPECT_EQ(dataset->camera().width, 64);
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }), "has 100x100");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(2); }),
                  "rgb/2.png: image of 32x24");
}

TEST_F(BadRecording, AllFramesCorruptNamesTheFirst)
{
  for (int i = 0; i < 3; ++i)
    recordings::truncate(place + "/depth/" + std::to_string(i) + ".png", 0.6);
  EXPECT_CONTAINS(openError(place), "depth/0.png: the image is truncated");
}

TEST_F(BadRecording, TruncatedImagesAreFound)
{
  const auto dataset = openDataset(place);
  for (const double share : {0.2, 0.5, 0.9, 0.999}) {
    recordings::writeImage(place + "/rgb/0.png", recordings::color(0));
    recordings::truncate(place + "/rgb/0.png", share);
    EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }),
                    "rgb/0.png: the image is truncated")
        << share;
  }
}

TEST_F(BadRecording, TruncatedJpegIsFoundAndTrailingBytesAreNot)
{
  writeText(place + "/rgb.txt", "0 rgb/0.jpg\n0.1 rgb/1.png");
  const std::string file = place + "/rgb/0.jpg";
  recordings::writeImage(file, recordings::color(0));
  const auto dataset = openDataset(place);
  writeText(file, readText(file) + std::string(1000, '\0'));
  EXPECT_NO_THROW(dataset->read(0));
  for (const double share : {0.5, 0.9, 0.999}) {
    recordings::writeImage(file, recordings::color(0));
    recordings::truncate(file, share);
    EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }),
                    "0.jpg: the image is truncated")
        << share;
  }
  // A disk that was full often leaves a file of the right size that ends in zeros.
  recordings::writeImage(file, recordings::color(0));
  std::string bytes = readText(file);
  std::fill(bytes.begin() + bytes.size() / 2, bytes.end(), '\0');
  writeText(file, bytes);
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }), "is truncated");
}

TEST_F(BadRecording, CorruptMiddleOfAPngIsFound)
{
  const auto dataset = openDataset(place);
  std::string bytes = readText(place + "/rgb/0.png");
  std::fill_n(bytes.begin() + bytes.size() / 2, 40, '\x55');
  writeText(place + "/rgb/0.png", bytes);
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }),
                  "rgb/0.png: cannot be decoded");
}

TEST_F(BadRecording, FileThatVanishedIsNamed)
{
  const auto dataset = openDataset(place);
  boost::filesystem::remove(place + "/rgb/1.png");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(1); }),
                  "rgb/1.png: cannot be opened: No such file");
}

TEST(BadSevenScenes, OtherSizesNeedIntrinsics)
{
  const TemporaryFolder folder;
  recordings::writeSevenScenesFrame(folder.path(), 0, recordings::color(0),
                                    recordings::depth(1000));
  EXPECT_CONTAINS(openError(folder.path()), "(from the format (7-Scenes)) are for 640x480");
  writeText(folder.path("camera-intrinsics.txt"), "60 0 32\n0 60 24\n");
  EXPECT_CONTAINS(openError(folder.path()), "camera-intrinsics.txt: 6 numbers; expected 9");
  boost::filesystem::remove(folder.path("frame-000000.depth.png"));
  EXPECT_CONTAINS(openError(folder.path()), "no frame has both");
}

TEST(BadOpen3d, ABrokenCalibrationDoesNoHarmWhereTheOptionsHaveIntrinsics)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 2);
  writeText(folder.path("intrinsic.json"), R"({"fx": 60, "fy": 60, "ppx": 32, "ppy": 24,
                "model": "ftheta", "coeffs": [1, 2], "depth_scale": 4000})");
  EXPECT_CONTAINS(openError(folder.path()), "intrinsic.json: the distortion model 'ftheta'");
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("60,60,32,24");
  const auto dataset = openDataset(folder.path(), options);
  EXPECT_FLOAT_EQ(dataset->read(0).depth.at<float>(0, 0), 1); // its scale is not used either
  std::string warning;
  for (const Finding& finding : dataset->findings())
    if (finding.severity == Severity::WARNING)
      warning += finding.what;
  EXPECT_CONTAINS(warning, "the calibration file is not used");
  EXPECT_CONTAINS(warning, "'ftheta'");
}

TEST(BadOpen3d, IntrinsicsMissingOrOfAnotherSize)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 2);
  writeText(folder.path("intrinsic.json"),
            R"({"width": 640, "height": 480,
                "intrinsic_matrix": [525, 0, 0, 0, 525, 0, 319.5, 239.5, 1]})");
  EXPECT_CONTAINS(openError(folder.path()), "are for 640x480");
  boost::filesystem::remove(folder.path("intrinsic.json"));
  EXPECT_CONTAINS(openError(folder.path()), "--intrinsics");
  boost::filesystem::remove_all(folder.path("depth"));
  boost::filesystem::create_directories(folder.path("depth"));
  EXPECT_CONTAINS(openError(folder.path()), "depth: the folder holds no image");
}
