// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/dense_matches.h"

#include "scenes.h"
#include "variants.h"

#include <gtest/gtest.h>
#include <pcl/common/transforms.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGBNormal>;

constexpr float GENEROUS = 1; // metres, more than any pair here is apart

/** One plane as source and target, and what matching finds. */
struct PlaneScene {
  CameraIntrinsics camera = smallCamera();
  Cloud::Ptr source, target;
  Pose world_from_virtual = Pose::Identity();
  int num_threads = 1;

  explicit PlaneScene(const Eigen::Vector3d& normal = {0.2, -0.1, 1}, double distance = 1.5)
  {
    source = toPointCloud(makeDepthView(planeDepth(camera, normal.normalized(), distance), camera));
    target.reset(new Cloud(*source));
  }

  AlignmentProblem
  problem() const
  {
    AlignmentProblem problem;
    problem.source = viewPoints(*source);
    problem.camera = camera;
    problem.num_threads = num_threads;
    return problem;
  }

  SourcePoints
  points() const
  {
    AlignmentProblem of_all = problem();
    std::vector<int> all(source->size());
    for (std::size_t i = 0; i < all.size(); ++i)
      all[i] = int(i);
    of_all.source_indices = &all;
    return selectLevels(of_all, true).back();
  }

  TargetGrid
  grid() const
  {
    TargetGrid grid;
    grid.points = viewPoints(*target);
    grid.camera = camera;
    grid.world_from_virtual = world_from_virtual;
    return grid;
  }

  Matches
  match(const Pose& pose, const MatchTolerance& tolerance = {GENEROUS, 0},
        const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) const
  {
    Matches matches;
    matchByProjection(problem(), grid(), points(), pose, center, tolerance, matches);
    return matches;
  }

  Meeting
  meeting(const Pose& pose) const
  {
    return meetingByProjection(grid(), points(), pose, match(pose, {0.2f, 0}), 1);
  }

  void
  turnSourceNormals(double angle)
  {
    const Eigen::Matrix3f turn = Eigen::AngleAxisf(float(angle), Eigen::Vector3f::UnitX()).matrix();
    for (pcl::PointXYZRGBNormal& point : *source)
      point.getNormalVector3fMap() = turn * point.getNormalVector3fMap();
  }
};

Pose
shift(double x, double y, double z)
{
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

std::size_t
countMatched(const Matches& matches)
{
  return std::size_t(std::count_if(matches.target.begin(), matches.target.end(),
                                   [](int target) { return target >= 0; }));
}

} // namespace

TEST(MatchByProjection, PointsMeetThemselvesInTheirOwnPixels)
{
  const PlaneScene scene;
  const SourcePoints points = scene.points();
  const Matches matches = scene.match(Pose::Identity());
  ASSERT_GT(points.size(), 10000u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(matches.target[i], points.index[i]);
    ASSERT_NEAR(matches.residual[i], 0, 1e-6);
  }
  EXPECT_EQ(matches.size() % Matches::LANES, 0u);
}

TEST(MatchByProjection, ResidualIsTheDistanceFromThePlane)
{
  const PlaneScene scene;
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
  const Pose pose = increment((Vector6d() << 0.02, -0.01, 0.03, 0.01, 0.02, -0.03).finished());
  const Eigen::Vector3d center(0.1, 0.2, 1.4);
  const SourcePoints points = scene.points();
  const Matches matches = scene.match(pose, {GENEROUS, 0}, center);
  std::size_t matched = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (matches.target[i] < 0)
      continue;
    ++matched;
    const Eigen::Vector3d p = pose * Eigen::Vector3d(points.x[i], points.y[i], points.z[i]);
    const Eigen::Vector3d n(matches.nx[i], matches.ny[i], matches.nz[i]);
    // The normal is towards the camera, the other way than the plane's own.
    ASSERT_NEAR(matches.residual[i], 1.5 - normal.dot(p), 1e-5);
    ASSERT_LT((n + normal).norm(), 1e-3);
    ASSERT_LT((Eigen::Vector3d(matches.px[i], matches.py[i], matches.pz[i]) + center - p).norm(),
              1e-5);
    const Eigen::Vector3d own(matches.sx[i], matches.sy[i], matches.sz[i]);
    ASSERT_LT((own + pose.linear() * normal).norm(), 1e-3) << "the source's, in the world";
  }
  EXPECT_GT(matched, points.size() * 8 / 10);
}

TEST(MatchByProjection, SigmaIsThatOfTheDepthAndOfTheMisalignment)
{
  const PlaneScene scene;
  const SourcePoints points = scene.points();
  for (const float misalignment : {0.0f, 0.03f, 0.3f}) {
    const Matches matches = scene.match(Pose::Identity(), {GENEROUS, misalignment});
    for (std::size_t i = 0; i < points.size(); i += 50) {
      const double sigma = scene.camera.depth_noise.sigma(double(points.z[i]));
      EXPECT_NEAR(1 / matches.inverse_sigma[i], std::hypot(sigma, misalignment), 1e-5);
    }
  }
}

TEST(MatchByProjection, KeepsToTheLargestDistance)
{
  const PlaneScene scene({0, 0, 1});
  EXPECT_EQ(countMatched(scene.match(shift(0, 0, -0.2), {0.19f, 0})), 0u);
  // Pixels apart from the middle lie up to 20 cm beside their matches, too.
  EXPECT_GT(countMatched(scene.match(shift(0, 0, -0.2), {0.21f, 0})), 100u);
  EXPECT_GT(countMatched(scene.match(shift(0, 0, -0.2), {0.40f, 0})), 10000u);
}

TEST(MatchByProjection, SurfacesThatFaceOtherwiseDoNotMatch)
{
  // The largest cosine is 0.6: 53 degrees
  for (const auto& [angle, matched] :
       {std::pair(50.0, true), std::pair(56.0, false), std::pair(180.0, false)}) {
    PlaneScene scene;
    scene.turnSourceNormals(angle * M_PI / 180);
    EXPECT_EQ(countMatched(scene.match(Pose::Identity())) > 0, matched) << angle;
  }
  PlaneScene scene;
  AlignmentProblem bare = scene.problem();
  SourcePoints points = scene.points();
  points.nx.clear();
  Matches matches;
  matchByProjection(bare, scene.grid(), points, Pose::Identity(), Eigen::Vector3d::Zero(),
                    {GENEROUS, 0}, matches);
  EXPECT_EQ(countMatched(matches), points.size()) << "without normals nothing faces otherwise";
  EXPECT_EQ(matches.sx, matches.nx);
}

TEST(MatchByProjection, EntriesWithoutMatchAreZeroAlsoWhereOneWasBefore)
{
  PlaneScene scene;
  for (std::size_t i = 0; i < scene.target->size(); i += 2)
    ((i % 4) ? (*scene.target)[i].x : (*scene.target)[i].normal_z) = std::nanf("");
  const SourcePoints points = scene.points();
  Matches matches;
  // First all match, then half are gone.
  matchByProjection(scene.problem(), PlaneScene().grid(), points, shift(0, 0, 0.01),
                    Eigen::Vector3d::Zero(), {GENEROUS, 0}, matches);
  ASSERT_GT(countMatched(matches), points.size() * 9 / 10);
  matchByProjection(scene.problem(), scene.grid(), points, Pose::Identity(),
                    Eigen::Vector3d::Zero(), {GENEROUS, 0}, matches);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const bool measured = i < points.size() && points.index[i] % 2 == 1;
    ASSERT_EQ(matches.target[i] >= 0, measured) << i;
    if (measured)
      continue;
    for (const std::vector<float>* list :
         {&matches.px, &matches.py, &matches.pz, &matches.nx, &matches.ny, &matches.nz, &matches.sx,
          &matches.sy, &matches.sz, &matches.residual, &matches.inverse_sigma})
      ASSERT_EQ((*list)[i], 0) << i;
  }
}

TEST(MatchByProjection, PointsBesideOrBehindTheCameraDoNotMatch)
{
  const PlaneScene scene;
  EXPECT_EQ(countMatched(scene.match(shift(0, 0, -3), {100, 0})), 0u);
  EXPECT_EQ(countMatched(scene.match(shift(5, 0, 0), {100, 0})), 0u);
  EXPECT_EQ(countMatched(scene.match(shift(0, -5, 0), {100, 0})), 0u);
}

TEST(MatchByProjection, FollowsTheWorldFrame)
{
  PlaneScene scene;
  const Pose pose = randomMotion(3, 0.02, 0.02), world = randomMotion(4, 1.5, 2);
  const Matches here = scene.match(pose);
  pcl::transformPointCloudWithNormals(*scene.target, *scene.target, world.matrix().cast<float>());
  scene.world_from_virtual = world;
  const Matches there = scene.match(world * pose);
  std::size_t same = 0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (here.target[i] != there.target[i])
      continue; // rounding, at the border of two pixels
    ++same;
    ASSERT_NEAR(here.residual[i], there.residual[i], 5e-6);
    ASSERT_EQ(here.inverse_sigma[i], there.inverse_sigma[i]);
  }
  EXPECT_GT(same, here.size() * 99 / 100);
}

TEST(MatchByProjection, ThreadsAndInstructionSetsGiveTheSameBits)
{
  PlaneScene scene;
  const Pose pose = randomMotion(5, 0.02, 0.02);
  const Matches expected = scene.match(pose);
  forEachVariant([&] {
    for (const int threads : {1, 3}) {
      scene.num_threads = threads;
      const Matches matches = scene.match(pose);
      EXPECT_EQ(matches.target, expected.target);
      EXPECT_EQ(matches.residual, expected.residual);
      EXPECT_EQ(matches.inverse_sigma, expected.inverse_sigma);
    }
  });
}

TEST(MeetingByProjection, TellsNearPointsFromThoseBehindAndInFront)
{
  PlaneScene scene({0, 0, 1});
  const auto total = double(scene.points().size());
  const Meeting same = scene.meeting(Pose::Identity());
  EXPECT_EQ(same.near, total);
  EXPECT_EQ(same.against, 0);
  // A plane that is moved back stays within the image, as points move towards its middle.
  const Meeting behind = scene.meeting(shift(0, 0, 0.1));
  EXPECT_EQ(behind.near, 0);
  EXPECT_EQ(behind.against, total);
  const Meeting in_front = scene.meeting(shift(0, 0, -0.1));
  EXPECT_EQ(in_front.near, 0);
  // Those that are still seen count twice; the image lost a border of 1 - (1.4 / 1.5)^2.
  EXPECT_NEAR(in_front.against / total, 2 * 1.4 * 1.4 / (1.5 * 1.5), 0.05);
}

TEST(MeetingByProjection, SaysNothingWhereTheTargetWasNotMeasured)
{
  PlaneScene scene({0, 0, 1});
  const auto total = double(scene.points().size());
  for (std::size_t i = 0; i < scene.target->size(); ++i)
    if (i % 160 < 80)
      (*scene.target)[i].x = (*scene.target)[i].y = (*scene.target)[i].z = std::nanf("");
  const Meeting same = scene.meeting(Pose::Identity());
  EXPECT_EQ(same.near, total / 2);
  EXPECT_EQ(same.against, 0);
  EXPECT_NEAR(scene.meeting(shift(0, 0, 0.1)).against, total / 2, 0.01 * total);
  EXPECT_EQ(scene.meeting(shift(0, 0, -5)).against, 0) << "behind the camera nothing is seen";
}

TEST(RobustScale, IsTheStandardDeviationOfMostMatches)
{
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Matches matches;
  matches.resize(20000);
  for (const double factor : {0.01, 1.0, 30.0}) {
    for (std::size_t i = 0; i < matches.size(); ++i) {
      matches.inverse_sigma[i] = i % 2 ? 100.0f : 50.0f;
      matches.residual[i] = float(factor * normal(random)) / matches.inverse_sigma[i];
    }
    EXPECT_NEAR(robustScale(matches) / factor, 1, 0.03);
    EXPECT_NEAR(rmsError(matches) / factor, 1, 0.03);
    for (std::size_t i = 0; i < matches.size(); i += 5) // a fifth is far away
      matches.residual[i] = float(20 * factor) / matches.inverse_sigma[i];
    EXPECT_LT(robustScale(matches) / factor, 1.4);
    EXPECT_GT(rmsError(matches) / factor, 8);
  }
}

TEST(RobustScale, OfNoMatchesIsZero)
{
  Matches matches;
  EXPECT_EQ(robustScale(matches), 0);
  matches.resize(40);
  std::fill(matches.residual.begin(), matches.residual.end(), 1.0f); // without a match
  EXPECT_EQ(robustScale(matches), 0);
  EXPECT_EQ(rmsError(matches), 0);
}
