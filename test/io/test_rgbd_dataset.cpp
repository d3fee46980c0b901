// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/io/rgbd_dataset.h>

#include "messages.h"
#include "recordings.h"

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>

using namespace bundle_icp;

namespace {

std::vector<std::size_t>
ids(const RGBDDataset& dataset)
{
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < dataset.size(); ++i)
    result.push_back(dataset.id(i));
  return result;
}

// Centre of a bright blob in an otherwise dark image.
Eigen::Vector2d
blobCentre(const cv::Mat& color)
{
  cv::Mat grey;
  cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
  const cv::Moments moments = cv::moments(grey);
  return {moments.m10 / moments.m00, moments.m01 / moments.m00};
}

bool
sameFrames(const RGBDFrame& a, const RGBDFrame& b)
{
  cv::Mat bits_a(a.depth.size(), CV_32SC1, a.depth.data);
  cv::Mat bits_b(b.depth.size(), CV_32SC1, b.depth.data);
  return a.id == b.id && a.timestamp == b.timestamp &&
         cv::norm(a.color, b.color, cv::NORM_INF) == 0 &&
         cv::norm(bits_a, bits_b, cv::NORM_INF) == 0;
}

} // namespace

TEST(TumDataset, ReadsFramesInMetres)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 3);
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(dataset->format(), "TUM RGB-D");
  ASSERT_EQ(dataset->size(), 3u);
  EXPECT_TRUE(dataset->isOrdered());
  EXPECT_TRUE(dataset->skipped().empty());
  EXPECT_TRUE(dataset->groundTruth().empty());
  EXPECT_EQ(dataset->camera().fx, 60);
  EXPECT_EQ(dataset->camera().width, 64);
  const RGBDFrame frame = dataset->read(2);
  EXPECT_EQ(frame.id, 2u);
  EXPECT_NEAR(frame.timestamp, 0.2, 1e-9);
  EXPECT_EQ(dataset->timestamp(2), frame.timestamp);
  EXPECT_EQ(dataset->name(2), folder.path("rgb/2.png"));
  EXPECT_EQ(cv::norm(frame.color, recordings::color(2), cv::NORM_INF), 0);
  ASSERT_EQ(frame.depth.type(), CV_32FC1);
  EXPECT_FLOAT_EQ(frame.depth.at<float>(10, 20), 1.2f);
}

TEST(TumDataset, UnmeasuredDepthIsNaN)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 1);
  cv::Mat depth = recordings::depth(5000);
  depth.at<std::uint16_t>(3, 4) = 0;
  depth.at<std::uint16_t>(5, 6) = 65535;
  recordings::writeImage(folder.path("depth/0.png"), depth);
  const RGBDFrame frame = openDataset(folder.path())->read(0);
  EXPECT_TRUE(std::isnan(frame.depth.at<float>(3, 4)));
  EXPECT_TRUE(std::isnan(frame.depth.at<float>(5, 6)));
  EXPECT_EQ(frame.depth.at<float>(7, 8), 1.f);
}

TEST(TumDataset, AssociatesClosestFirstAndOneToOne)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 3);
  // Depth 0 is closer to colour 1 than to colour 0, which takes nothing; depth 1 and
  // colour 2 are 20 ms apart, which is no longer below the bound.
  writeText(folder.path("rgb.txt"), "0.000 rgb/0.png\n0.010 rgb/1.png\n0.125 rgb/2.png\n");
  writeText(folder.path("depth.txt"), "0.007 depth/0.png\n0.1 depth/1.png\n0.13 depth/2.png");
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(ids(*dataset), (std::vector<std::size_t>{1, 2}));
  EXPECT_FLOAT_EQ(dataset->read(0).depth.at<float>(0, 0), 1.f);
  EXPECT_FLOAT_EQ(dataset->read(1).depth.at<float>(0, 0), 1.2f);
  ASSERT_EQ(dataset->skipped().size(), 2u);
  EXPECT_EQ(dataset->skipped()[0].file, folder.path("rgb/0.png"));
  EXPECT_CONTAINS(dataset->skipped()[0].reason, "no depth image within 0.02");
  EXPECT_EQ(dataset->skipped()[1].file, folder.path("depth/1.png"));
}

TEST(TumDataset, AbsentFilesAreSkippedBeforeAssociation)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 3);
  boost::filesystem::remove(folder.path("rgb/0.png"));
  boost::filesystem::remove(folder.path("depth/1.png"));
  // Colour 1's closest depth image is absent; it takes depth 0.
  writeText(folder.path("depth.txt"), "0.09 depth/0.png\n0.1 depth/1.png\n0.2 depth/2.png");
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(ids(*dataset), (std::vector<std::size_t>{1, 2})); // numbers of lines in rgb.txt
  EXPECT_FLOAT_EQ(dataset->read(0).depth.at<float>(0, 0), 1.f);
  ASSERT_EQ(dataset->skipped().size(), 2u);
  EXPECT_EQ(dataset->skipped()[0].reason, "listed in rgb.txt but absent");
  EXPECT_EQ(dataset->skipped()[1].reason, "listed in depth.txt but absent");
}

TEST(TumDataset, KnowsTheBenchmarksCamerasByFolder)
{
  const TemporaryFolder folder;
  const std::string place = folder.path("rgbd_dataset_freiburg2_desk_10hz");
  recordings::writeTum(place, 1, {640, 480});
  boost::filesystem::remove(place + "/intrinsics.txt");
  boost::filesystem::create_directory_symlink(place, folder.path("link"));
  for (const std::string& name : {place, place + "/", place + "/rgb/..", folder.path("link")})
    EXPECT_EQ(openDataset(name)->camera().fx, 520.9) << name;
  EXPECT_FALSE(openDataset(place)->camera().hasDistortion());
}

TEST(TumDataset, OptionsBeatFileBeatsName)
{
  const TemporaryFolder folder;
  const std::string place = folder.path("freiburg3_test");
  recordings::writeTum(place, 1, {640, 480});
  DatasetOptions options;
  writeText(place + "/intrinsics.txt", "# fx fy cx cy\n500 501 320 240 # px\ndepth_scale 2500\n");
  EXPECT_EQ(openDataset(place)->camera().fy, 501);
  EXPECT_EQ(openDataset(place)->read(0).depth.at<float>(0, 0), 2.f);
  options.intrinsics = parseIntrinsics("400,401,320,240");
  options.depth_scale = 1000;
  EXPECT_EQ(openDataset(place, options)->camera().fy, 401);
  EXPECT_EQ(openDataset(place, options)->read(0).depth.at<float>(0, 0), 5.f);
  boost::filesystem::remove(place + "/intrinsics.txt");
  EXPECT_EQ(openDataset(place)->camera().fy, 539.2);
}

TEST(TumDataset, RemovesDistortionFromColourAndDepth)
{
  const TemporaryFolder folder;
  const cv::Size size(320, 240);
  recordings::writeTum(folder.path(), 1, size);
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("250,250,160,120,0.2,-0.1,0.002,-0.003,0.05");
  const CameraIntrinsics& camera = *options.intrinsics;
  // A point that an ideal camera sees at (270, 190), drawn where this one sees it.
  const double x = (270 - camera.cx) / camera.fx, y = (190 - camera.cy) / camera.fy;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double u = x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2 * x * x);
  const double v = y * radial + camera.p1 * (r2 + 2 * y * y) + 2 * camera.p2 * x * y;
  const cv::Point2d seen(u * camera.fx + camera.cx, v * camera.fy + camera.cy);
  ASSERT_GT(std::hypot(seen.x - 270, seen.y - 190), 3);
  cv::Mat color(size, CV_8UC3, cv::Scalar::all(0)), depth = recordings::depth(5000, size);
  cv::circle(color, cv::Point(seen * 16), 6 * 16, cv::Scalar::all(255), -1, cv::LINE_AA, 4);
  cv::circle(depth, cv::Point(seen * 16), 6 * 16, cv::Scalar(10000), -1, cv::LINE_8, 4);
  recordings::writeImage(folder.path("rgb/0.png"), color);
  recordings::writeImage(folder.path("depth/0.png"), depth);

  const RGBDFrame frame = openDataset(folder.path(), options)->read(0);
  EXPECT_LT((blobCentre(frame.color) - Eigen::Vector2d(270, 190)).norm(), 0.1);
  const cv::Moments moments = cv::moments(frame.depth == 2.f, true);
  EXPECT_NEAR(moments.m10 / moments.m00, 270, 0.3);
  EXPECT_NEAR(moments.m01 / moments.m00, 190, 0.3);
  // No mixture of the two depths.
  EXPECT_EQ(cv::countNonZero(frame.depth == frame.depth),
            cv::countNonZero(frame.depth == 1.f) + cv::countNonZero(frame.depth == 2.f));

  options.undistort_depth = false;
  const RGBDFrame raw = openDataset(folder.path(), options)->read(0);
  EXPECT_EQ(cv::countNonZero(raw.depth == 2.f), cv::countNonZero(depth == 10000));
  EXPECT_EQ(raw.depth.at<float>(cv::Point(seen)), 2.f);
}

TEST(TumDataset, ReadsAnySizePortraitToo)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 1, {37, 61});
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(dataset->camera().height, 61);
  EXPECT_EQ(dataset->read(0).depth.size(), cv::Size(37, 61));
}

TEST(TumDataset, UnusableTruthDoesNoHarm)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 1);
  writeText(folder.path("groundtruth.txt"), "0 1 2 3 0 0 0 1\n0.1 nan 2 3 0 0 0 1\n");
  const auto dataset = openDataset(folder.path());
  EXPECT_TRUE(dataset->groundTruth().empty());
  ASSERT_EQ(dataset->skipped().size(), 1u);
  EXPECT_CONTAINS(dataset->skipped()[0].reason, "groundtruth.txt:2: 'nan'");
  writeText(folder.path("groundtruth.txt"), "0 1 2 3 0 0 0 1\n0.1 1 2 3 0 0 0 1\n");
  EXPECT_EQ(openDataset(folder.path())->groundTruth().size(), 2u);
}

TEST(SevenScenesDataset, WarpsColourIntoTheDepthCamera)
{
  const TemporaryFolder folder;
  const cv::Size size(640, 480);
  // A point 1.25 m away that the depth camera sees at (400, 300); the colour camera, 25
  // mm beside it, sees it here (figures of the 7-Scenes warp).
  const double z = 1.25, zoom = 526.5 / 585;
  const cv::Point2d seen(zoom * (400 - 320) + 320 - 0.025 * 526.5 / z,
                         zoom * (300 - 240) + 240 - 2);
  cv::Mat color(size, CV_8UC3, cv::Scalar::all(0)), depth = recordings::depth(1250, size);
  cv::circle(color, cv::Point(seen * 16), 6 * 16, cv::Scalar::all(255), -1, cv::LINE_AA, 4);
  depth(cv::Rect(390, 290, 17, 23)) = 0; // a hole takes the depth around it
  depth(cv::Rect(410, 290, 3, 3)) = 65535;
  recordings::writeSevenScenesFrame(folder.path(), 0, color, depth);
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(dataset->format(), "7-Scenes");
  EXPECT_EQ(dataset->camera().fx, 585);
  const RGBDFrame frame = dataset->read(0);
  EXPECT_LT((blobCentre(frame.color) - Eigen::Vector2d(400, 300)).norm(), 0.1);
  EXPECT_TRUE(std::isnan(frame.depth.at<float>(300, 400)));
  EXPECT_TRUE(std::isnan(frame.depth.at<float>(291, 411)));
  EXPECT_EQ(frame.depth.at<float>(100, 100), 1.25f);
}

TEST(SevenScenesDataset, LeavesOtherCamerasAlone)
{
  const TemporaryFolder folder;
  const cv::Size size(640, 480);
  const std::string run = folder.path("seq-01");
  recordings::writeSevenScenesFrame(run, 7, recordings::color(0, size),
                                    recordings::depth(1000, size));
  // 3DMatch keeps the calibration of a scene beside its runs.
  writeText(folder.path("camera-intrinsics.txt"), "570 0 320\n0 571 240\n0 0 1\n");
  const auto dataset = openDataset(run);
  EXPECT_EQ(dataset->camera().fy, 571);
  EXPECT_EQ(cv::norm(dataset->read(0).color, recordings::color(0, size), cv::NORM_INF), 0);
}

TEST(SevenScenesDataset, WarpsNothingOfOthersWithTheSameIntrinsics)
{
  const TemporaryFolder folder;
  const cv::Size size(640, 480);
  const auto is_warped = [&](const DatasetOptions& options = {}) {
    const auto dataset = openDataset(folder.path(), options);
    bool is_said = false;
    for (const Finding& finding : dataset->findings())
      is_said = is_said || finding.what.find("colour is warped") != std::string::npos;
    const double change =
        cv::norm(dataset->read(0).color, recordings::color(0, size), cv::NORM_INF);
    EXPECT_EQ(is_said, change > 0);
    return is_said;
  };
  recordings::writeSevenScenesFrame(folder.path(), 0, recordings::color(0, size),
                                    recordings::depth(1000, size));
  writeText(folder.path("camera-intrinsics.txt"), "585 0 320\n0 585 240\n0 0 1\n");
  EXPECT_TRUE(is_warped());
  DatasetOptions options;
  options.depth_factor = 1.01; // a correction of millimetres
  EXPECT_TRUE(is_warped(options));
  options.depth_scale = 5000;
  EXPECT_FALSE(is_warped(options));
  boost::filesystem::remove(folder.path("frame-000000.pose.txt"));
  EXPECT_FALSE(is_warped());
}

TEST(SevenScenesDataset, RefusesToWarpByDepthOfFloats)
{
  const TemporaryFolder folder;
  const cv::Size size(640, 480);
  recordings::writeSevenScenesFrame(folder.path(), 0, recordings::color(0, size),
                                    recordings::depth(1000, size));
  recordings::writeImage(folder.path("depth.tiff"), cv::Mat(size, CV_32FC1, cv::Scalar(1.5)));
  boost::filesystem::rename(folder.path("depth.tiff"), folder.path("frame-000000.depth.png"));
  const auto dataset = openDataset(folder.path());
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { dataset->read(0); }),
                  "frame-000000.depth.png: depth of floats");
}

TEST(SevenScenesDataset, NumbersMayHaveGaps)
{
  const TemporaryFolder folder;
  for (const int number : {30, 3, 12})
    recordings::writeSevenScenesFrame(folder.path(), number, recordings::color(number, {640, 480}),
                                      recordings::depth(1000 + number, {640, 480}));
  boost::filesystem::remove(folder.path("frame-000012.depth.png"));
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(ids(*dataset), (std::vector<std::size_t>{3, 30}));
  EXPECT_EQ(dataset->timestamp(1), 1.0);
  ASSERT_EQ(dataset->skipped().size(), 1u);
  EXPECT_EQ(dataset->skipped()[0].reason, "has no depth image of its number");
}

TEST(SevenScenesDataset, LeavesOutPosesThatAreNotRigid)
{
  const TemporaryFolder folder;
  for (int number = 0; number < 4; ++number)
    recordings::writeSevenScenesFrame(folder.path(), number, recordings::color(0, {640, 480}),
                                      recordings::depth(1000, {640, 480}));
  writeText(folder.path("frame-000001.pose.txt"),
            "nan nan nan nan\nnan nan nan nan\nnan nan nan nan\n0 0 0 1\n");
  writeText(folder.path("frame-000002.pose.txt"), "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
  writeText(folder.path("frame-000003.pose.txt"),
            "1.0001 0 0 5\n0 0.9999 0.0001 6\n0 0 1 7\n0 0 0 1\n");
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(dataset->size(), 4u);
  const Trajectory truth = dataset->groundTruth();
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(truth[1].timestamp, 3 / 30.0);
  EXPECT_TRUE(isRigid(truth[1].world_from_camera.matrix(), 1e-12)); // orthonormalised
  EXPECT_EQ(truth[1].world_from_camera.translation(), Eigen::Vector3d(5, 6, 7));
  ASSERT_EQ(dataset->skipped().size(), 2u);
  EXPECT_CONTAINS(dataset->skipped()[0].reason, "'nan' is not a finite number");
  EXPECT_CONTAINS(dataset->skipped()[1].reason, "not a rigid motion");
}

TEST(Open3dDataset, PairsByNumberInNaturalOrder)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 12);
  boost::filesystem::remove(folder.path("color/3.png"));
  boost::filesystem::remove(folder.path("depth/5.png"));
  const auto dataset = openDataset(folder.path());
  EXPECT_EQ(dataset->format(), "Open3D");
  EXPECT_EQ(ids(*dataset), (std::vector<std::size_t>{0, 1, 2, 4, 6, 7, 8, 9, 10, 11}));
  EXPECT_EQ(dataset->camera().fy, 61);
  EXPECT_EQ(dataset->camera().cx, 32);
  EXPECT_FLOAT_EQ(dataset->read(9).depth.at<float>(0, 0), 2.1f);
  EXPECT_EQ(dataset->timestamp(9), 11 / 30.0);
  EXPECT_EQ(dataset->skipped().size(), 2u);
}

TEST(Open3dDataset, PairsByWhatDiffersAndNeverByOrder)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 0);
  for (int i = 0; i < 3; ++i) {
    const std::string letter(1, char('a' + i));
    recordings::writeImage(folder.path("image/" + letter + ".png"), recordings::color(i));
    recordings::writeImage(folder.path("depth/z" + letter + ".png"),
                           recordings::depth(1000 + 100 * i));
  }
  EXPECT_EQ(ids(*openDataset(folder.path())), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_FLOAT_EQ(openDataset(folder.path())->read(2).depth.at<float>(0, 0), 1.2f);
  boost::filesystem::remove(folder.path("depth/za.png"));
  EXPECT_EQ(ids(*openDataset(folder.path())), (std::vector<std::size_t>{1, 2}));
  boost::filesystem::rename(folder.path("depth/zb.png"), folder.path("depth/k.png"));
  boost::filesystem::rename(folder.path("depth/zc.png"), folder.path("depth/l.png"));
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(folder.path()); }),
                  "names of 3 colour and 2 depth images do not say");
}

TEST(Open3dDataset, RefusesARowMajorMatrix)
{
  const TemporaryFolder folder;
  recordings::writeOpen3d(folder.path(), 1);
  writeText(folder.path("intrinsic.json"),
            R"({"intrinsic_matrix": [60, 0, 32, 0, 60, 24, 0, 0, 1]})");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(folder.path()); }),
                  "column by column");
  writeText(folder.path("intrinsic.json"), "{\"width\": 64");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { openDataset(folder.path()); }),
                  "intrinsic.json");
}

TEST(RGBDDataset, SeveralThreadsReadTheSameAsOne)
{
  const TemporaryFolder folder;
  recordings::writeTum(folder.path(), 8);
  DatasetOptions options;
  options.intrinsics = parseIntrinsics("60,60,32,24,0.1,0,0,0,0");
  const auto dataset = openDataset(folder.path(), options);
  std::vector<RGBDFrame> frames(8);
#pragma omp parallel for num_threads(4)
  for (int i = 0; i < 8; ++i)
    frames[i] = dataset->read(i);
  for (int i = 0; i < 8; ++i)
    EXPECT_TRUE(sameFrames(frames[i], dataset->read(i))) << i;
}
