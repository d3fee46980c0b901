// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
// What a run keeps on disk: a later run takes it, and gives the same result.
#include "messages.h"
#include "scan/frames.h"
#include "scan/scan_database.h"
#include "temporary_folder.h"

#include <boost/filesystem.hpp>
#include <opencv2/core.hpp>
#include <sqlite3.h>

#include <cstring>

using namespace bundle_icp;
using namespace bundle_icp::test;
namespace fs = boost::filesystem;

namespace {

class Database : public ::testing::Test {
protected:
  std::string
  openError(bool fresh = false) const
  {
    return messageOf<pcl::IOException>([&] { ScanDatabase(path, fresh); });
  }

  /** The numbers of the first column that a query by hand gives. */
  std::vector<std::int64_t>
  numbers(const std::string& sql) const
  {
    std::vector<std::int64_t> result;
    sqlite3* handle = nullptr;
    EXPECT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
    const auto take = [](void* to, int, char** values, char**) {
      static_cast<std::vector<std::int64_t>*>(to)->push_back(values[0] ? std::stoll(values[0]) : 0);
      return 0;
    };
    EXPECT_EQ(sqlite3_exec(handle, sql.c_str(), take, &result, nullptr), SQLITE_OK)
        << sqlite3_errmsg(handle);
    sqlite3_close(handle);
    return result;
  }

  ReconstructionOptions
  options() const
  {
    ReconstructionOptions result = withoutMesh();
    result.database = ScanDatabaseOptions{path};
    return result;
  }

  TemporaryFolder folder;
  const std::string path = folder.path("scan.db");
  const CameraIntrinsics camera = room().camera();
};

Features
featuresOf(std::size_t frame)
{
  return extractFeatures(Frames({frame}).read(0), room().camera());
}

FramePair
pairOf(const Features& first, const Features& second)
{
  return verifyMatches(first, second, matchDescriptors(first.descriptors, second.descriptors),
                       room().camera());
}

bool
areSame(const std::vector<FeatureMatch>& a, const std::vector<FeatureMatch>& b)
{
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const FeatureMatch& x, const FeatureMatch& y) {
                      return x.first == y.first && x.second == y.second;
                    });
}

void
expectSame(const Features& a, const Features& b)
{
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_EQ(a.pixel_sigmas, b.pixel_sigmas);
  EXPECT_EQ(std::memcmp(a.depths.data(), b.depths.data(), a.size() * sizeof(float)), 0);
  EXPECT_EQ(std::memcmp(a.depth_sigmas.data(), b.depth_sigmas.data(), a.size() * sizeof(float)), 0);
  EXPECT_EQ(a.depth_slopes, b.depth_slopes);
  EXPECT_EQ(a.colors, b.colors);
  ASSERT_EQ(a.descriptors.size(), b.descriptors.size());
  EXPECT_EQ(cv::norm(a.descriptors, b.descriptors, cv::NORM_INF), 0);
  EXPECT_EQ(a.sharpness, b.sharpness);
}

void
expectSamePoses(const ReconstructionResult& a, const ReconstructionResult& b)
{
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    EXPECT_TRUE(a.frames[i].registered);
    EXPECT_EQ(a.frames[i].world_from_camera.matrix(), b.frames[i].world_from_camera.matrix()) << i;
  }
}

} // namespace

TEST_F(Database, GivesWhatItGotToTheBit)
{
  const Features first = featuresOf(0), second = featuresOf(4);
  const FramePair pair = pairOf(first, second);
  ASSERT_GT(pair.matches.size(), 50u);
  ScanDatabase::ImageId a = 0, b = 0;
  {
    ScanDatabase database(path, false);
    b = database.image("second", 2, camera);
    a = database.image("first", 1, camera);
    EXPECT_FALSE(database.features(a));
    database.addFeatures(a, first);
    database.addFeatures(b, second);
    EXPECT_FALSE(database.pair(a, b, 7));
    database.addPair(a, b, 7, pair, camera);
  }
  ScanDatabase database(path, false);
  EXPECT_EQ(database.image("first", 1, camera), a);
  EXPECT_EQ(database.image("second", 2, camera), b);
  expectSame(database.features(a).value(), first);
  expectSame(database.features(b).value(), second);
  const FramePair again = database.pair(a, b, 7).value();
  EXPECT_TRUE(areSame(again.matches, pair.matches));
  EXPECT_TRUE(areSame(again.matches_of_other_motion, pair.matches_of_other_motion));
  EXPECT_EQ(again.first_from_second.matrix(), pair.first_from_second.matrix());
  EXPECT_EQ(again.num_putative, pair.num_putative);
  EXPECT_FALSE(database.pair(b, a, 7)) << "the matches are those of the other direction";
  EXPECT_FALSE(database.pair(a, b, 8)) << "other options";
}

TEST_F(Database, ChangedImageLosesItsFeaturesAndItsPairs)
{
  const Features features = featuresOf(0);
  ScanDatabase::ImageId changed = 0, other = 0;
  {
    ScanDatabase database(path, false);
    const auto before = database.image("first", 1, camera);
    other = database.image("second", 2, camera);
    database.addFeatures(before, features);
    database.addFeatures(other, features);
    database.addPair(before, other, 7, pairOf(features, features), camera);
    changed = database.image("first", 3, camera);
    EXPECT_FALSE(database.features(changed));
    EXPECT_TRUE(database.features(other));
    EXPECT_FALSE(database.pair(changed, other, 7));
  }
  EXPECT_EQ(numbers("SELECT count(*) FROM matches"), std::vector<std::int64_t>{0});
  ScanDatabase database(path, true);
  EXPECT_NE(database.image("second", 2, camera), other) << "a fresh one holds nothing";
}

TEST_F(Database, HasTheTablesOfColmap)
{
  const Features first = featuresOf(0), second = featuresOf(4);
  const FramePair pair = pairOf(first, second);
  {
    ScanDatabase database(path, false);
    const auto b = database.image("b", 2, camera), a = database.image("a", 1, camera);
    database.addFeatures(a, first);
    database.addFeatures(b, second);
    database.addPair(a, b, 7, pair, camera); // the one with the higher number is the first
  }
  EXPECT_EQ(numbers("SELECT rows FROM keypoints ORDER BY image_id"),
            (std::vector<std::int64_t>{std::int64_t(second.size()), std::int64_t(first.size())}));
  EXPECT_EQ(numbers("SELECT pair_id FROM two_view_geometries"),
            std::vector<std::int64_t>{1 * 2147483647ll + 2});
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  ASSERT_EQ(
      sqlite3_prepare_v2(handle,
                         "SELECT g.data, g.F, k1.data, k2.data, rows FROM two_view_geometries "
                         "g, (SELECT data FROM keypoints WHERE image_id = 1) k1, "
                         "(SELECT data FROM keypoints WHERE image_id = 2) k2",
                         -1, &statement, nullptr),
      SQLITE_OK);
  ASSERT_EQ(sqlite3_step(statement), SQLITE_ROW);
  const auto* const matches = static_cast<const std::uint32_t*>(sqlite3_column_blob(statement, 0));
  const Eigen::Matrix3d fundamental =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
          static_cast<const double*>(sqlite3_column_blob(statement, 1)));
  const auto keypoint = [&](int column, std::uint32_t index) {
    const auto* const data = static_cast<const float*>(sqlite3_column_blob(statement, column));
    return Eigen::Vector3d(data[2 * index], data[2 * index + 1], 1);
  };
  const int rows = sqlite3_column_int(statement, 4);
  ASSERT_EQ(rows, int(pair.matches.size()));
  int near_line = 0;
  for (int i = 0; i < rows; ++i) {
    const Eigen::Vector3d line = fundamental * keypoint(2, matches[2 * i]);
    near_line +=
        std::abs(keypoint(3, matches[2 * i + 1]).dot(line)) < 2 * line.head<2>().norm(); // 2 px
  }
  EXPECT_GT(near_line, 0.95 * rows);
  sqlite3_finalize(statement);
  sqlite3_close(handle);
}

TEST_F(Database, RefusesWhatIsNoneAndLeavesIt)
{
  writeText(path, std::string(5000, 'x'));
  EXPECT_EQ(openError(), path + ": is no scan database; move it away");
  EXPECT_EQ(openError(true), path + ": is no scan database; move it away");
  EXPECT_EQ(readText(path), std::string(5000, 'x'));
  fs::remove(path);
  numbers("CREATE TABLE addresses (street TEXT)");
  const std::string foreign = readText(path);
  EXPECT_EQ(openError(true), path + ": is a database of another program; move it away");
  EXPECT_EQ(readText(path), foreign);
  fs::remove(path);
  fs::create_directory(path);
  EXPECT_EQ(openError(), path + ": is not a regular file");
  fs::remove(path);
  {
    ScanDatabase open(path, false);
    EXPECT_EQ(openError(true), path + ": another run uses it; wait until that has ended");
  }
  numbers("UPDATE bundle_icp_schema SET version = 99");
  EXPECT_CONTAINS(openError(true), "scan.db: is a scan database of another version");
}

TEST_F(Database, NoticesDamage)
{
  const Features features = featuresOf(0);
  ScanDatabase::ImageId image = 0;
  {
    ScanDatabase database(path, false);
    image = database.image("first", 1, camera);
    database.addFeatures(image, features);
  }
  // One bit of the image's descriptors.
  std::string bytes = readText(path);
  cv::Mat doubled = features.descriptors.row(3) * 2;
  const std::size_t place =
      bytes.find(std::string(reinterpret_cast<const char*>(doubled.data), 128));
  ASSERT_NE(place, std::string::npos);
  bytes[place + 7] = char(bytes[place + 7] ^ 2);
  writeText(path, bytes);
  ScanDatabase database(path, false);
  EXPECT_EQ(messageOf<pcl::IOException>([&] { database.features(image); }),
            path + ": is damaged; move it away");
}

TEST_F(Database, AfterAFailureNothingIsKept)
{
  const Features features = featuresOf(0);
  {
    ScanDatabase database(path, false);
    const auto image = database.image("first", 1, camera);
    database.addFeatures(image, features);
    database.commit();
    const auto other = database.image("second", 2, camera);
    const auto wrong = [&] { database.addFeatures(other + 99, features); }; // no such image
    const std::string error = messageOf<pcl::IOException>(wrong);
    EXPECT_CONTAINS(error, "scan.db: FOREIGN KEY");
    EXPECT_EQ(messageOf<pcl::IOException>([&] { database.addFeatures(image, features); }), error);
    EXPECT_EQ(messageOf<pcl::IOException>([&] { database.commit(); }), error);
  }
  EXPECT_EQ(numbers("SELECT count(*) FROM images"), std::vector<std::int64_t>{1});
  ScanDatabase database(path, false);
  expectSame(database.features(database.image("first", 1, camera)).value(), features);
}

TEST_F(Database, SecondRunTakesAllAndGivesTheSame)
{
  const Frames frames(everyFourth());
  const ReconstructionResult first = reconstruct(frames, options());
  EXPECT_EQ(first.reused.features + first.reused.pairs, 0u);
  expectSamePoses(first, reference());
  const ReconstructionResult second = reconstruct(frames, options());
  EXPECT_EQ(second.reused.features, frames.size());
  EXPECT_EQ(second.reused.pairs, frames.size() * (frames.size() - 1) / 2);
  EXPECT_FALSE(first.reused.poses);
  EXPECT_TRUE(second.reused.poses);
  expectSamePoses(second, reference());
  // In another order, on one thread.
  ReconstructionOptions shuffled = options();
  shuffled.num_threads = 1;
  const Frames others({28, 4, 0, 12, 8, 20, 16, 24});
  const ReconstructionResult third = reconstruct(others, shuffled);
  EXPECT_EQ(third.reused.pairs, second.reused.pairs);
  for (const FrameReport& frame : third.frames)
    for (const FrameReport& before : first.frames)
      if (before.id == frame.id) {
        EXPECT_EQ(frame.world_from_camera.matrix(), before.world_from_camera.matrix());
      }
}

TEST_F(Database, OtherOptionsTakeWhatDoesNotDependOnThem)
{
  const Frames frames(everyFourth());
  reconstruct(frames, options());
  ReconstructionOptions changed = options();
  changed.graph.matching.ratio = 0.75;
  ReconstructionResult result = reconstruct(frames, changed);
  EXPECT_EQ(result.reused.features, frames.size());
  EXPECT_EQ(result.reused.pairs, 0u);
  changed.features.max_features = 800;
  result = reconstruct(frames, changed);
  EXPECT_EQ(result.reused.features, 0u);
  changed.database->fresh = true;
  result = reconstruct(frames, changed);
  EXPECT_EQ(result.reused.features, 0u);
  // Frames that come later.
  changed.database->fresh = false;
  result = reconstruct(Frames({0, 4, 8, 12, 16, 20, 24, 28, 32, 36}), changed);
  EXPECT_EQ(result.reused.features, 8u);
  EXPECT_EQ(result.reused.pairs, 28u);
  EXPECT_FALSE(result.reused.poses);
}

TEST_F(Database, PosesAreThoseOfTheSameFramesAndOptions)
{
  const Frames frames(everyFourth());
  reconstruct(frames, options());
  ReconstructionOptions changed = options();
  changed.volume.voxel_size = 0.02;
  EXPECT_TRUE(reconstruct(frames, changed).reused.poses);
  changed.mapper.registration.max_views = 5;
  EXPECT_FALSE(reconstruct(frames, changed).reused.poses);
  EXPECT_TRUE(reconstruct(frames, changed).reused.poses);
  changed.depth_reduction = 2;
  EXPECT_FALSE(reconstruct(frames, changed).reused.poses);
  changed.mapper.refinement.calibration[CalibrationParameter::FOCAL_X] = 0.001;
  EXPECT_FALSE(reconstruct(frames, changed).reused.poses);
  EXPECT_FALSE(reconstruct(Frames({0, 4, 8, 12, 16, 20, 24}), changed).reused.poses);
}

TEST_F(Database, TakesFeaturesAndMatchesOfOtherRuns)
{
  ReconstructionOptions first = options(), second = options(), both = options();
  first.database->path = folder.path("first.db");
  second.database->path = folder.path("second.db");
  reconstruct(Frames({0, 4, 8, 12}), first);
  reconstruct(Frames({16, 20, 24, 28}), second);
  both.database->sources = {first.database->path, second.database->path};
  const Frames frames(everyFourth());
  const ReconstructionResult result = reconstruct(frames, both);
  EXPECT_EQ(result.reused.features, 8u);
  EXPECT_EQ(result.reused.pairs, 12u) << "those within either run";
  expectSamePoses(result, reference());
  EXPECT_EQ(numbers("SELECT count(*) FROM cameras"), std::vector<std::int64_t>{1});
  // A source that is none.
  both.database->sources = {folder.path("none.db")};
  writeText(folder.path("none.db"), "this is not a database, but long enough to be taken for one");
  EXPECT_CONTAINS(messageOf<pcl::IOException>([&] { reconstruct(frames, both); }),
                  "none.db: is no scan database");
}

TEST_F(Database, StoppedRunGoesOn)
{
  const Frames frames(everyFourth());
  for (const std::string stage : {"features", "matching", "registration"}) {
    ReconstructionOptions run = options();
    run.num_threads = 1;
    run.database->fresh = true;
    reconstruct(frames, run,
                [&](const Progress& p) { return p.stage != stage || p.done < p.total / 2; });
    const ReconstructionResult result = reconstruct(frames, options());
    EXPECT_GE(result.reused.features + result.reused.pairs, 4u);
    expectSamePoses(result, reference());
  }
}
