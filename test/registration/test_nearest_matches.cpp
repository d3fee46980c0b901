// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/nearest_matches.h"

#include "nearest_points.h"
#include "scenes.h"

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr float ANY_DISTANCE = 1e18f;

/** Clouds as floats, in any unit, and what the nearest neighbours say of them. */
struct CloudPair {
  pcl::PointCloud<pcl::PointXYZ> source, target;
  std::vector<float> target_normals; ///< as wide as the points; empty without normals
  std::vector<Eigen::Vector3f> source_normals;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();

  AlignmentProblem
  problem() const
  {
    AlignmentProblem problem;
    problem.source = viewPoints(source);
    problem.target = viewPoints(target);
    if (!target_normals.empty())
      problem.target.normals = target_normals.data();
    problem.nearest = nearestByComparison(problem.target);
    problem.num_threads = 2;
    return problem;
  }

  SourcePoints
  points() const
  {
    SourcePoints points;
    for (std::size_t i = 0; i < source.size(); ++i) {
      points.index.push_back(int(i));
      points.x.push_back(source[i].x);
      points.y.push_back(source[i].y);
      points.z.push_back(source[i].z);
    }
    for (const Eigen::Vector3f& normal : source_normals) {
      points.nx.push_back(normal.x());
      points.ny.push_back(normal.y());
      points.nz.push_back(normal.z());
    }
    return points;
  }

  Matches
  match(const Pose& pose = Pose::Identity(), float max_distance = ANY_DISTANCE) const
  {
    const AlignmentProblem of_clouds = problem();
    Matches matches;
    NearestMatcher(of_clouds).match(points(), pose, center, max_distance, matches);
    return matches;
  }

  Meeting
  meeting(const Pose& pose) const
  {
    const AlignmentProblem of_clouds = problem();
    NearestMatcher matcher(of_clouds);
    Matches matches;
    matcher.match(points(), pose, center, ANY_DISTANCE, matches);
    return matcher.meeting(points(), matches, center);
  }
};

enum class Shape { LINE, PLANE, VOLUME };

/** Points spread over a unit of the shape's own size; the plane is 2 x + y - 2 z = 0. */
pcl::PointCloud<pcl::PointXYZ>
scattered(Shape shape, int count, unsigned seed, float unit = 1)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  pcl::PointCloud<pcl::PointXYZ> cloud;
  for (int i = 0; i < count; ++i) {
    const float a = uniform(random), b = uniform(random), c = uniform(random);
    const Eigen::Vector3f p = shape == Shape::LINE    ? Eigen::Vector3f(a, 2 * a, -a)
                              : shape == Shape::PLANE ? Eigen::Vector3f(a, b, a + b / 2)
                                                      : Eigen::Vector3f(a, b, c);
    cloud.push_back({unit * p.x(), unit * p.y(), unit * p.z()});
  }
  return cloud;
}

const Eigen::Vector3d PLANE_NORMAL(2.0 / 3, 1.0 / 3, -2.0 / 3);

Pose
shift(const Eigen::Vector3d& by)
{
  Pose pose = Pose::Identity();
  pose.translation() = by;
  return pose;
}

} // namespace

TEST(NearestMatcher, MatchesEachPointWithItsNearestWithinTheLimit)
{
  CloudPair clouds;
  clouds.source = scattered(Shape::PLANE, 100, 1);
  clouds.target = scattered(Shape::PLANE, 400, 2);
  const Pose pose = randomMotion(1, 0.1, 0.1);
  constexpr float LIMIT = 0.1f;
  const Matches all = clouds.match(pose), near = clouds.match(pose, LIMIT);
  std::size_t beyond = 0;
  for (std::size_t i = 0; i < clouds.source.size(); ++i) {
    const Eigen::Vector3f p =
        (pose * clouds.source[i].getVector3fMap().cast<double>()).cast<float>();
    float least = ANY_DISTANCE;
    for (const pcl::PointXYZ& q : clouds.target)
      least = std::min(least, (q.getVector3fMap() - p).norm());
    ASSERT_GE(all.target[i], 0);
    const auto matched = std::size_t(all.target[i]);
    EXPECT_EQ((clouds.target[matched].getVector3fMap() - p).norm(), least);
    EXPECT_EQ(near.target[i] >= 0, least <= LIMIT);
    beyond += least > LIMIT ? 1 : 0;
  }
  EXPECT_GT(beyond, 5u);
  EXPECT_LT(beyond, 95u);
}

TEST(NearestMatcher, FitsTheNormalOfAPlaneAndMeasuresAlongIt)
{
  CloudPair clouds;
  clouds.source = scattered(Shape::PLANE, 100, 1);
  clouds.target = scattered(Shape::PLANE, 1000, 2);
  clouds.center = Eigen::Vector3d(0.3, -0.2, 0.1);
  const Pose pose = shift(0.05 * PLANE_NORMAL + Eigen::Vector3d(0.02, 0, 0.02)); // along it, too
  const Matches matches = clouds.match(pose);
  for (std::size_t i = 0; i < clouds.source.size(); ++i) {
    const Eigen::Vector3d n(matches.nx[i], matches.ny[i], matches.nz[i]);
    const double side = n.dot(PLANE_NORMAL);
    EXPECT_NEAR(std::abs(side), 1, 1e-5) << "either side, as points do not tell";
    EXPECT_NEAR(matches.residual[i], 0.05 * side, 1e-5);
    EXPECT_EQ(matches.inverse_sigma[i], 1);
    const Eigen::Vector3d p(matches.px[i], matches.py[i], matches.pz[i]);
    const Eigen::Vector3d moved = pose * clouds.source[i].getVector3fMap().cast<double>();
    EXPECT_LT((p + clouds.center - moved).norm(), 1e-6);
  }
}

TEST(NearestMatcher, WithoutAPlaneMeasuresAlongTheThreeAxes)
{
  for (const Shape shape : {Shape::LINE, Shape::VOLUME}) {
    CloudPair clouds;
    clouds.source = scattered(shape, 100, 1);
    clouds.target = scattered(shape, 100, 1);
    const Eigen::Vector3d by(1e-3, -2e-3, 3e-3);
    const std::size_t size = clouds.source.size();
    const Matches matches = clouds.match(shift(by));
    ASSERT_GE(matches.size(), 3 * size);
    std::size_t own = 0;
    for (std::size_t i = 0; i < size; ++i) {
      if (matches.target[i] != int(i))
        continue; // a point of the line that is nearer than the own one
      ++own;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t k = i + axis * size;
        EXPECT_EQ(matches.target[k], int(i));
        EXPECT_NEAR(matches.residual[k], by[Eigen::Index(axis)], 1e-6);
        EXPECT_EQ(Eigen::Vector3f(matches.nx[k], matches.ny[k], matches.nz[k]),
                  Eigen::Vector3f::Unit(Eigen::Index(axis)));
      }
    }
    EXPECT_GT(own, 60u);
  }
}

TEST(NearestMatcher, TakesTheNormalsOfTheTargetAndComparesTheSources)
{
  CloudPair clouds;
  clouds.source = clouds.target = scattered(Shape::PLANE, 100, 1);
  const Eigen::Vector3f other_normal = Eigen::Vector3f(1, 0, 1).normalized(); // not the plane's
  // Of points with room for a fourth number
  for (std::size_t i = 0; i < clouds.target.size(); ++i)
    for (const float value : {other_normal.x(), other_normal.y(), other_normal.z(), 0.0f})
      clouds.target_normals.push_back(value);
  const Matches bare = clouds.match();
  EXPECT_EQ(bare.nx[7], other_normal.x());
  EXPECT_EQ(bare.sx[7], other_normal.x()) << "a source without normals has none to compare";

  // Every other point of the source faces the other way.
  for (std::size_t i = 0; i < clouds.source.size(); ++i)
    clouds.source_normals.push_back(i % 2 ? other_normal : Eigen::Vector3f(-other_normal));
  const Matches compared = clouds.match();
  for (std::size_t i = 0; i < clouds.source.size(); ++i) {
    EXPECT_EQ(compared.target[i] >= 0, i % 2 == 1);
    EXPECT_EQ(compared.inverse_sigma[i] > 0, i % 2 == 1);
  }
}

TEST(NearestMatcher, NormalsThatAreNotFiniteMatchNothing)
{
  CloudPair clouds;
  clouds.source = clouds.target = scattered(Shape::PLANE, 50, 1);
  clouds.target_normals.assign(4 * clouds.target.size(), 0.5f);
  clouds.target_normals[4 * 20 + 1] = std::nanf("");
  const Matches matches = clouds.match();
  EXPECT_EQ(matches.target[20], -1);
  EXPECT_EQ(matches.inverse_sigma[20], 0);
  EXPECT_EQ(matches.target[21], 21);
}

TEST(NearestMatcher, MeetingTellsNearFromFarInAnyUnit)
{
  for (const float unit : {0.001f, 1.0f, 1000.0f}) {
    CloudPair clouds;
    clouds.source = scattered(Shape::PLANE, 200, 1, unit);
    clouds.target = scattered(Shape::PLANE, 2000, 2, unit);
    const Meeting same = clouds.meeting(Pose::Identity());
    EXPECT_GT(same.near, 190) << unit;
    // Neighbours are some 0.05 apart: 0.2 off is against the pose, 2 off says nothing.
    const Meeting off = clouds.meeting(shift(0.2 * double(unit) * PLANE_NORMAL));
    EXPECT_LT(off.near, 30) << unit;
    EXPECT_GT(off.against, 3 * 140) << unit;
    const Meeting away = clouds.meeting(shift(5 * double(unit) * PLANE_NORMAL));
    EXPECT_EQ(away.near, 0) << unit;
    EXPECT_EQ(away.against, 0) << unit;
  }
}

TEST(NearestMatcher, FollowsTheWorldFrame)
{
  CloudPair clouds;
  clouds.source = scattered(Shape::PLANE, 100, 1);
  clouds.target = scattered(Shape::PLANE, 500, 2);
  const Pose pose = randomMotion(2, 0.05, 0.05), world = randomMotion(3, 2, 2);
  const Matches here = clouds.match(pose);
  for (pcl::PointXYZ& point : clouds.target)
    point.getVector3fMap() = (world * point.getVector3fMap().cast<double>()).cast<float>();
  const Matches there = clouds.match(world * pose);
  std::size_t same = 0;
  for (std::size_t i = 0; i < clouds.source.size(); ++i)
    if (here.target[i] == there.target[i]) {
      ++same;
      EXPECT_NEAR(std::abs(here.residual[i]), std::abs(there.residual[i]), 1e-4);
    }
  EXPECT_GE(same, 98u) << "but for pairs at equal distance";
}
