// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "registration/source_points.h"

#include "scenes.h"

#include <gtest/gtest.h>

#include <numeric>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

/** A cloud whose points tell their index. */
struct NumberedCloud {
  pcl::PointCloud<pcl::PointNormal> cloud;
  std::vector<int> indices;
  double focal = 525;

  NumberedCloud(unsigned width, unsigned height) : cloud(width, height), indices(width * height)
  {
    std::iota(indices.begin(), indices.end(), 0);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const auto number = float(i);
      cloud[i].getVector3fMap() << number, -number, 2 * number;
      cloud[i].getNormalVector3fMap() << 0, 0, -1;
    }
  }

  std::vector<SourcePoints>
  levels(bool projective = true, int num_threads = 1) const
  {
    AlignmentProblem problem;
    problem.source = viewPoints(cloud);
    problem.source_indices = &indices;
    problem.camera = smallCamera(int(cloud.width), int(cloud.height), focal);
    problem.num_threads = num_threads;
    return selectLevels(problem, projective);
  }
};

const float NOT_A_NUMBER = std::numeric_limits<float>::quiet_NaN();

} // namespace

TEST(SourcePoints, LevelsOfAnImageAreEveryFourthSecondAndOnePixelBothWays)
{
  const NumberedCloud numbered(320, 240);
  const std::vector<SourcePoints> levels = numbered.levels();
  ASSERT_EQ(levels.size(), 3u);
  const int strides[] = {4, 2, 1};
  for (std::size_t l = 0; l < 3; ++l) {
    const int stride = strides[l];
    EXPECT_EQ(levels[l].stride, stride);
    ASSERT_EQ(levels[l].size(), std::size_t(320 * 240 / (stride * stride)));
    for (std::size_t k = 0; k < levels[l].size(); ++k) {
      const int i = levels[l].index[k];
      ASSERT_EQ(i % 320 % stride, stride / 2);
      ASSERT_EQ(i / 320 % stride, stride / 2);
      ASSERT_EQ(levels[l].x[k], float(i)) << "the coordinates are the point's own";
      ASSERT_EQ(levels[l].y[k], float(-i));
      ASSERT_EQ(levels[l].z[k], float(2 * i));
      ASSERT_EQ(levels[l].nz[k], -1);
    }
    EXPECT_TRUE(std::is_sorted(levels[l].index.begin(), levels[l].index.end()));
  }
}

TEST(SourcePoints, LargeImagesAreThinnedAndSmallOnesAreNot)
{
  // 80,000 points are enough for the last level, and none has fewer than 500 if there are as many.
  const std::vector<SourcePoints> large = NumberedCloud(1280, 960).levels();
  EXPECT_EQ(large[0].stride, 16);
  EXPECT_EQ(large[2].stride, 4);
  EXPECT_EQ(large[2].size(), 1280u * 960 / 16);
  const std::vector<SourcePoints> small = NumberedCloud(64, 48).levels();
  EXPECT_EQ(small[0].stride, 2);
  EXPECT_EQ(small[0].size(), 32u * 24);
  for (const SourcePoints& level : NumberedCloud(20, 20).levels())
    EXPECT_EQ(level.size(), 400u);
}

TEST(SourcePoints, OfAListAreAsManyAsOfAnImage)
{
  const NumberedCloud numbered(320 * 240, 1);
  const std::vector<SourcePoints> levels = numbered.levels(false);
  for (const SourcePoints& level : levels) {
    const int step = level.stride * level.stride;
    ASSERT_EQ(level.size(), std::size_t(320 * 240 / step));
    for (std::size_t k = 0; k < level.size(); ++k)
      ASSERT_EQ(level.index[k], int(k) * step);
  }
  EXPECT_EQ(levels[0].stride, 4);
}

TEST(SourcePoints, PointsAndNormalsThatAreNotFiniteAreLeftOut)
{
  NumberedCloud numbered(20, 20);
  numbered.cloud[30].y = NOT_A_NUMBER;
  numbered.cloud[31].x = std::numeric_limits<float>::infinity();
  numbered.cloud[32].z = 1e30f;
  numbered.cloud[33].normal_x = NOT_A_NUMBER;
  numbered.cloud[34].normal_y = 100;
  const SourcePoints last = numbered.levels().back();
  EXPECT_EQ(last.size(), 395u);
  for (int i = 0; i < 400; ++i)
    EXPECT_EQ(std::count(last.index.begin(), last.index.end(), i), i < 30 || i > 34 ? 1 : 0) << i;
}

TEST(SourcePoints, OnlyTheNamedIndicesThatExistAreUsed)
{
  NumberedCloud numbered(20, 20);
  numbered.indices = {7, -1, 399, 400, 1 << 30, 12};
  for (const SourcePoints& level : numbered.levels())
    EXPECT_EQ(level.index, std::vector<int>({7, 399, 12}));
  numbered.indices.clear();
  for (const SourcePoints& level : numbered.levels())
    EXPECT_EQ(level.size(), 0u);
}

TEST(SourcePoints, ShareTheNoiseOfAPatchOfThePixelsBetweenThem)
{
  // 9 x 9 pixels at 525 px, so 4.5 x 4.5 at half the focal length
  NumberedCloud numbered(320, 240);
  EXPECT_DOUBLE_EQ(numbered.levels()[0].patch, 81.0 / 16);
  EXPECT_DOUBLE_EQ(numbered.levels()[2].patch, 81);
  numbered.focal = 262.5;
  EXPECT_DOUBLE_EQ(numbered.levels()[2].patch, 81.0 / 4);
  EXPECT_DOUBLE_EQ(numbered.levels()[0].patch, 81.0 / 64);
  numbered.focal = 100;
  EXPECT_DOUBLE_EQ(numbered.levels()[0].patch, 1)
      << "a point shares its noise with itself at least";
  for (const SourcePoints& level : NumberedCloud(320, 240).levels(false))
    EXPECT_EQ(level.patch, 1);
}

TEST(SourcePoints, ThreadsDoNotMatter)
{
  const NumberedCloud numbered(640, 480);
  const std::vector<SourcePoints> one = numbered.levels(true, 1), four = numbered.levels(true, 4);
  for (std::size_t l = 0; l < 3; ++l) {
    EXPECT_EQ(one[l].index, four[l].index);
    EXPECT_EQ(one[l].z, four[l].z);
  }
}
