// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "scan/frames.h"
#include "temporary_folder.h"
#include "volume/rendered_frame.h"

#include <bundle_icp/io/memory_dataset.h>

#include <boost/filesystem.hpp>
#include <nlohmann/json.hpp>
#include <pcl/kdtree/kdtree_flann.h>

#include <map>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A ball of the room in which no frame measures depth. */
struct Unseen {
  Eigen::Vector3d center;
  double radius = 0;

  bool
  holds(const Eigen::Vector3d& point) const
  {
    return (point - center).norm() < radius;
  }
};

/** Around a point of the carpet that all frames show. */
Unseen
partOfTheCarpet()
{
  constexpr int u = 130, v = 205; // [px]
  const RGBDFrame frame = room().readExact(16);
  return {room().worldFromCamera(16) * room().camera().unproject(u, v, frame.depth.at<float>(v, u)),
          0.3};
}

/** Points that a frame without faults shows, and that lie in the room. */
std::vector<Eigen::Vector3d>
pointsOf(const RGBDFrame& frame, const Pose& world_from_camera)
{
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v < frame.depth.rows; v += 6)
    for (int u = 0; u < frame.depth.cols; u += 6)
      points.push_back(world_from_camera *
                       room().camera().unproject(u, v, frame.depth.at<float>(v, u)));
  return points;
}

/** Some frames of the room without depth in the ball. */
MemoryDataset
scanWithout(const Unseen& unseen)
{
  MemoryDataset dataset(room().camera());
  const Frames frames(everyFourth());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    RGBDFrame frame = frames.read(i);
    frame.depth = frame.depth.clone();
    const Pose world_from_camera = room().worldFromCamera(everyFourth()[i]);
    for (int v = 0; v < frame.depth.rows; ++v)
      for (int u = 0; u < frame.depth.cols; ++u)
        if (float& z = frame.depth.at<float>(v, u);
            unseen.holds(world_from_camera * room().camera().unproject(u, v, z)))
          z = std::numeric_limits<float>::quiet_NaN();
    dataset.add(frame);
  }
  return dataset;
}

ReconstructionOptions
withNextViews()
{
  ReconstructionOptions options;
  options.volume.voxel_size = 0.01;
  options.next_views.emplace();
  return options;
}

Pose
truthFromResult()
{
  return room().worldFromCamera(everyFourth().front());
}

/** How many points have no vertex of the mesh within 3 cm. */
std::size_t
countMissing(const std::vector<Eigen::Vector3d>& points, const ReconstructionResult& result)
{
  const SurfaceMesh mesh = toSurfaceMesh(result.mesh);
  pcl::PointCloud<pcl::PointXYZ>::Ptr vertices(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const Eigen::Vector3f place = (truthFromResult() * vertex.cast<double>()).cast<float>();
    vertices->push_back({place.x(), place.y(), place.z()});
  }
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(vertices);
  std::size_t missing = 0;
  for (const Eigen::Vector3d& point : points) {
    pcl::Indices index;
    std::vector<float> square;
    tree.nearestKSearch({float(point.x()), float(point.y()), float(point.z())}, 1, index, square);
    missing += square.front() > 0.03f * 0.03f;
  }
  return missing;
}

const ReconstructionResult&
resultWithHole()
{
  static const ReconstructionResult result =
      reconstruct(scanWithout(partOfTheCarpet()), withNextViews());
  return result;
}

} // namespace

TEST(NextViews, AFrameFromTheSuggestedPoseIsRegisteredAndClosesTheHole)
{
  const ReconstructionResult& before = resultWithHole();
  ASSERT_FALSE(before.next_views.empty());
  const NextView& view = before.next_views.front();
  EXPECT_EQ(view.purpose, NextViewPurpose::CLOSE_HOLE);

  // The largest hole is the floor behind the table, of which no frame shows anything.
  const Eigen::Vector3d middle = truthFromResult() * view.center;
  EXPECT_LT(middle.z(), 0.4);
  EXPECT_GT(view.area, 0.5);

  // Somebody can hold a camera there, as upright as before.
  const Pose pose = truthFromResult() * view.world_from_camera;
  EXPECT_GT(room().distanceToSurface(pose.translation()), 0.05);
  const Pose nearest = room().worldFromCamera(everyFourth()[view.nearest_frame]);
  EXPECT_NEAR((pose.translation() - nearest.translation()).norm(), view.distance, 0.02);
  EXPECT_LT(std::abs(pose.linear()(2, 0)), 0.3); // the room's z is up: rows are level
  EXPECT_LT(pose.linear()(2, 1), 0);

  RGBDFrame frame = room().render(pose);
  const std::vector<Eigen::Vector3d> points = pointsOf(frame, pose);
  const std::size_t missing = countMissing(points, before);
  EXPECT_GT(missing, points.size() / 4);

  MemoryDataset dataset = scanWithout(partOfTheCarpet());
  frame.timestamp = dataset.timestamp(dataset.size() - 1) + 1;
  dataset.add(frame);
  const ReconstructionResult after = reconstruct(dataset, withNextViews());
  EXPECT_TRUE(after.frames.back().registered) << after.frames.back().reason;
  EXPECT_EQ(after.frames.back().component, 0);
  EXPECT_LT(countMissing(points, after), missing / 4);
  for (const NextView& other : after.next_views)
    EXPECT_LT(other.area, 0.8 * view.area);
}

TEST(NextViews, LookAtWhatIsMissing)
{
  const Unseen unseen = partOfTheCarpet();
  NextViewOptions options;
  options.region =
      OrientedBox(Pose(Eigen::Translation3d(truthFromResult().inverse() * unseen.center)),
                  Eigen::Vector3d::Constant(2 * unseen.radius));
  const std::vector<NextView> views = suggestViews(scanWithout(unseen), resultWithHole(), options);
  ASSERT_FALSE(views.empty());
  for (const NextView& view : views) {
    EXPECT_TRUE(options.region->contains(view.center));
    const Eigen::Vector3d seen = view.world_from_camera.inverse() * view.center;
    EXPECT_TRUE(room().camera().contains(room().camera().project(seen)));
  }
  EXPECT_LT((truthFromResult() * views.front().center - unseen.center).norm(),
            unseen.radius + 0.05);
}

TEST(NextViews, ThePictureShowsWhatIsMissing)
{
  for (const NextView& view : resultWithHole().next_views) {
    ASSERT_EQ(view.picture.size(), cv::Size(320, 240));
    std::size_t magenta = 0, surface = 0;
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 320; ++u) {
        const cv::Vec3b color = view.picture.at<cv::Vec3b>(v, u);
        const bool is_magenta = color[0] > 160 && color[2] > 160 && color[1] < 100;
        magenta += is_magenta;
        surface += !is_magenta && color != cv::Vec3b(255, 255, 255);
      }
    EXPECT_GT(magenta, 100u);
    EXPECT_GT(surface, 0.2 * 320 * 240);
  }
}

TEST(NextViews, ResultDoesNotDependOnThreads)
{
  const MemoryDataset dataset = scanWithout(partOfTheCarpet());
  NextViewOptions options;
  options.num_threads = 1;
  const auto one = suggestViews(dataset, resultWithHole(), options);
  options.num_threads = 5;
  const auto five = suggestViews(dataset, resultWithHole(), options);
  ASSERT_EQ(one.size(), five.size());
  ASSERT_GT(one.size(), 0u);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_TRUE(one[i].world_from_camera.matrix() == five[i].world_from_camera.matrix());
    EXPECT_EQ(one[i].area, five[i].area);
    EXPECT_EQ(cv::norm(one[i].picture, five[i].picture, cv::NORM_INF), 0);
  }
}

TEST(NextViews, EachSuggestionShowsSomethingNew)
{
  const std::vector<NextView>& views = resultWithHole().next_views;
  EXPECT_LE(views.size(), NextViewOptions().max_views);
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT((views[i].center - views[j].center).norm(), 0.05) << i << " and " << j;
}

TEST(NextViews, AClosedObjectNeedsNone)
{
  const std::vector<Pose> poses = posesAllAround(1.0);
  MemoryDataset dataset(smallCamera());
  ReconstructionOptions options = withNextViews();
  options.poses.emplace();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    RGBDFrame frame = render(sphere(0.3), poses[i]);
    frame.timestamp = double(i);
    dataset.add(frame);
    options.poses->trajectory.push_back({double(i), poses[i]});
  }
  const ReconstructionResult result = reconstruct(dataset, options);
  EXPECT_GT(result.mesh.polygons.size(), 1000u);
  EXPECT_TRUE(result.next_views.empty());
}

TEST(NextViews, NameTheFramesBetweenComponents)
{
  SyntheticScanOptions elsewhere;
  elsewhere.num_frames = 5;
  elsewhere.frame_rate = 5;
  elsewhere.width = 320;
  elsewhere.height = 240;
  elsewhere.focal_length = 262.5;
  elsewhere.start_time = 70; // at a wall that the frames before do not show
  const SyntheticScan wall(elsewhere);
  MemoryDataset dataset(room().camera());
  const Frames table(everyFourth());
  for (std::size_t i = 0; i < table.size(); ++i)
    dataset.add(table.read(i));
  for (std::size_t i = 0; i < wall.size(); ++i) {
    RGBDFrame frame = wall.read(i);
    frame.timestamp += 70;
    dataset.add(frame);
  }
  const ReconstructionResult result = reconstruct(dataset, withNextViews());
  ASSERT_EQ(result.component_sizes.size(), 2u);
  ASSERT_FALSE(result.next_views.empty());
  const NextView& view = result.next_views.front();
  EXPECT_EQ(view.purpose, NextViewPurpose::CONNECT_COMPONENT);
  EXPECT_EQ(view.component, 1);
  EXPECT_EQ(view.nearest_frame, table.size() - 1); // nearest in time
  EXPECT_EQ(view.other_frame, table.size());
  EXPECT_EQ(view.picture.cols, 320);
  const std::string text = toString(view, result);
  EXPECT_CONTAINS(text, "frame 7");
  EXPECT_CONTAINS(text, "frame 8");
}

TEST(NextViews, AreWrittenWithTheResult)
{
  const MemoryDataset dataset = scanWithout(partOfTheCarpet());
  const TemporaryFolder folder;
  writeText(folder.path("next_10.png"), "of an earlier result");
  ReconstructionResult result = resultWithHole();
  result.next_views.resize(2);
  writeReconstruction(folder.path(), dataset, withNextViews(), result);
  EXPECT_TRUE(boost::filesystem::exists(folder.path("next_01.png")));
  EXPECT_TRUE(boost::filesystem::exists(folder.path("next_02.png")));
  EXPECT_FALSE(boost::filesystem::exists(folder.path("next_10.png")));
  const auto report = nlohmann::json::parse(readText(folder.path("report.json")));
  ASSERT_EQ(report["next_views"].size(), 2u);
  const auto& view = report["next_views"][0];
  EXPECT_EQ(view["purpose"], "close_hole");
  EXPECT_EQ(view["world_from_camera"].size(), 7u);
  EXPECT_EQ(view["nearest_frame"], result.frames[result.next_views[0].nearest_frame].id);
  EXPECT_EQ(view["area"], result.next_views[0].area);
  std::map<std::string, std::size_t> files;
  for (const auto& file : report["files"])
    files[file["name"]] = file["bytes"];
  EXPECT_EQ(files["next_02.png"], readText(folder.path("next_02.png")).size());
}

TEST(NextViews, RefusesImpossibleOptions)
{
  const auto refuse = [](const auto& change) {
    NextViewOptions options;
    change(options);
    std::string error;
    EXPECT_FALSE(options.isValid(&error));
    EXPECT_CONTAINS(error, "NextViewOptions: ");
    return error;
  };
  EXPECT_CONTAINS(refuse([](auto& o) { o.max_views = 0; }), "max_views 0; expected 1 to 10");
  refuse([](auto& o) { o.max_views = 11; });
  refuse([](auto& o) { o.min_area = 0; });
  refuse([](auto& o) { o.min_shared = 1; });
  refuse([](auto& o) { o.max_gap = -1; });
  refuse([](auto& o) { o.max_gap = NAN; });
  refuse([](auto& o) { o.num_threads = -1; });
  refuse([](auto& o) { o.region = OrientedBox(Pose::Identity(), {0, 1, 1}); });

  ReconstructionOptions options = withoutMesh();
  options.next_views.emplace();
  std::string error;
  EXPECT_FALSE(options.isValid(&error));
  EXPECT_CONTAINS(error, "next_views");
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>(
                      [] { suggestViews(MemoryDataset(room().camera()), resultWithHole()); }),
                  "the dataset has 0");
}
