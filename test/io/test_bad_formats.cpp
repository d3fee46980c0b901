// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What happens to recordings with faults whose frames are image files.
#include "bad_format.h"

using namespace bundle_icp;
using namespace bad_format;
namespace fs = boost::filesystem;

TEST_F(BadFormat, UnknownFoldersAreToldWhatWouldWork)
{
  writeText(place + "/notes.txt", "nothing");
  const std::string message = openError(place);
  EXPECT_CONTAINS(message, "scan: unknown format. Looked for:\n  TUM RGB-D: rgb.txt and depth.txt");
  EXPECT_CONTAINS(message, "\n  ScanNet: one file x.sens\n");
  EXPECT_CONTAINS(message, place + "/color/000000.png");
  EXPECT_CONTAINS(message, place + "/intrinsics.txt with the line: fx fy cx cy");
  EXPECT_CONTAINS(message, "bundle_icp_reconstruct " + place + " -o result");
  writeText(place + "/scan.bag", "#ROSBAG V2.0");
  EXPECT_CONTAINS(openError(place), "scan.bag is a ROS or RealSense bag, whose images must be");
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

TEST_F(BadFormat, IclNuimIsKnownByItsFolder)
{
  const std::string traj = folder.path("living_room_traj0_frei_png");
  recordings::writeTum(traj, 2, {640, 480});
  for (const char* const file : {"rgb.txt", "depth.txt", "intrinsics.txt"})
    fs::remove(traj + "/" + file);
  writeText(traj + "/associations.txt", "1 depth/0.png 1 rgb/0.png\n2 depth/1.png 2 rgb/1.png\n");
  writeText(traj + "/livingRoom0.gt.freiburg", "1 0 0.5 0 0 0 0 1\n2 0 1 0 0 0 0 1\n");
  const auto dataset = openDataset(traj);
  EXPECT_EQ(dataset->camera().fx, 481.2);
  EXPECT_EQ(dataset->camera().fy, 480);
  ASSERT_EQ(dataset->groundTruth().size(), 2u);
  EXPECT_EQ(dataset->groundTruth()[1].world_from_camera.translation(), Eigen::Vector3d(0, -1, 0));
}

TEST_F(BadFormat, IclNuimIsKnownByItsPosesAndByTheOptions)
{
  write("associations");
  const Trajectory truth = openDataset(place)->groundTruth();
  const auto is_mirrored = [&](const DatasetOptions& options = {}) {
    const auto dataset = openDataset(place, options);
    EXPECT_EQ(dataset->camera().fy, 55);
    const Eigen::Vector3d before = truth.back().world_from_camera.translation(),
                          after = dataset->groundTruth().back().world_from_camera.translation();
    const bool result = after.isApprox(Eigen::Vector3d(before.x(), -before.y(), before.z()), 1e-9);
    EXPECT_EQ(findingOf(*dataset, "intrinsics", "y points upwards").has_value(), result);
    return result;
  };
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("55,55,31.5,23.5");
  EXPECT_FALSE(is_mirrored());
  EXPECT_FALSE(is_mirrored(options));
  options.intrinsics->fy = -55;
  EXPECT_TRUE(is_mirrored(options));
  fs::rename(place + "/groundtruth.txt", place + "/livingRoom1.gt.freiburg");
  EXPECT_TRUE(is_mirrored());
  options.intrinsics->fy = 55;
  EXPECT_TRUE(is_mirrored(options));
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
  EXPECT_CONTAINS(openDataset(place)->skipped().at(0).reason, "has no line that can be read in");
  // A damaged line costs its frame, not the recording.
  replace(place + "/odometry.csv", "000001", "00x001");
  ASSERT_EQ(openDataset(place)->size(), 1u);
  EXPECT_TRUE(findingOf(*openDataset(place), "pairing", "2 of 3 frames have no line that can be"));
  EXPECT_CONTAINS(openDataset(place)->skipped().at(0).reason,
                  "odometry.csv:3: '00x001' is not a number");
  writeText(place + "/odometry.csv", "timestamp, frame\n1, 0\n");
  EXPECT_CONTAINS(openError(place), "odometry.csv:2: expected timestamp, frame, x, y, z");
  writeText(place + "/odometry.csv", "1, 0, 0, 0, 0, 0, 0, 0, 2\n");
  EXPECT_CONTAINS(openError(place), "odometry.csv:1: the quaternion is not of unit length");
  writeText(place + "/camera_matrix.csv", "1,2,3");
  writeText(place + "/odometry.csv", "1, 0, 0, 0, 0, 0, 0, 0, 1\n");
  EXPECT_CONTAINS(openError(place), "camera_matrix.csv: 3 numbers; expected 9");
}

TEST_F(BadFormat, TheVideoOfStrayScannerIsRefusedWithTheCommandThatMakesImages)
{
  write("stray-scanner");
  fs::rename(place, folder.path("my room's scan")); // what a shell must not take apart
  place = folder.path("my room's scan");
  const std::string quoted = "'" + folder.path("my room'\\''s scan");
  fs::remove_all(place + "/rgb");
  EXPECT_CONTAINS(openError(place), "rgb: holds no images, and there is no rgb.mp4");
  writeText(place + "/rgb.mp4", "a video");
  const std::string command = "mkdir -p " + quoted + "/rgb' && ffmpeg -i " + quoted +
                              "/rgb.mp4' -fps_mode passthrough -start_number 0 " + quoted +
                              "/rgb/%06d.png'";
  EXPECT_CONTAINS(openError(place), "rgb.mp4: videos are not decoded");
  EXPECT_CONTAINS(openError(place), command);
  fs::create_directories(place + "/rgb"); // after a first attempt that failed
  EXPECT_CONTAINS(openError(place), command);
  for (const char* const name : {"000000.png", "000001.png", "000002.png"}) // as ffmpeg counts
    recordings::writeImage(place + "/rgb/" + name, recordings::color(name[5]));
  EXPECT_EQ(openDataset(place)->size(), 3u);
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
  replace(file, "     0.0,\n     0.0,\n     0.0,\n     1.0", "     0.0,\n     0.0,\n     1.0");
  EXPECT_EQ(openDataset(place)->groundTruth().size(), 2u);
  EXPECT_CONTAINS(openDataset(place)->skipped().at(0).reason, "3 or 4 rows of 4 numbers");
  writeText(file, whole);
  replace(file, "\"w\": 64", "\"w\": -4");
  EXPECT_CONTAINS(openError(place), "w is no size of an image");
  writeText(file, whole);
  replace(file, "\"cx\"", "\"k1\": 0.1, \"cx\"");
  EXPECT_TRUE(findingOf(*openDataset(place), "intrinsics", "with distortion"));
  writeText(file, whole);
  replace(file, "\"file_path\"", "\"mask_path\": \"half.png\", \"file_path\"");
  cv::Mat mask(48, 64, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 32, 48)) = 0;
  recordings::writeImage(place + "/half.png", mask);
  EXPECT_TRUE(findingOf(*openDataset(place), "masks", "1 of 3 frames have a mask"));
  EXPECT_EQ(cv::countNonZero(openDataset(place)->read(0).depth(cv::Rect(0, 0, 32, 48)) > 0), 0);
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
  const std::optional<Finding> finding =
      findingOf(*openDataset(place), "intrinsics", "its own intrinsics");
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->severity, Severity::WARNING); // 4 %
  EXPECT_NEAR(openDataset(place)->camera().fx, 55, 1e-9);
  writeText(file, whole);
  replace(file, "t_00", "t_99");
  EXPECT_EQ(openDataset(place)->groundTruth().size(), 2u);
  EXPECT_CONTAINS(openDataset(place)->skipped().at(0).reason,
                  "0.json: is not of the form that was expected");
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
