// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "scan/surface_gaps.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace bundle_icp;

namespace {

constexpr double CELL = 0.03;
constexpr double HALF = 1, HOLE = 0.2; ///< of the plate's edge and of its hole's [m]

bool
isInHole(double x, double y)
{
  return std::abs(x) < HOLE && std::abs(y) < HOLE;
}

/** A square plate with a square hole. */
SurfaceMesh
plate(const Pose& world_from_plate)
{
  constexpr int cells = 100;
  SurfaceMesh mesh;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      mesh.vertices.emplace_back(
          (world_from_plate *
           Eigen::Vector3d(2 * HALF * i / cells - HALF, 2 * HALF * j / cells - HALF, 0))
              .cast<float>());
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      if (isInHole(2 * HALF * (i + 0.5) / cells - HALF, 2 * HALF * (j + 0.5) / cells - HALF))
        continue;
      const auto a = std::uint32_t(j * (cells + 1) + i);
      mesh.triangles.push_back({a, a + 1, a + cells + 2});
      mesh.triangles.push_back({a, a + cells + 2, a + cells + 1});
    }
  return mesh;
}

SeenSpace
spaceOf(const SurfaceMesh& mesh)
{
  SeenSpace space({Eigen::Vector3d::Constant(-2), Eigen::Vector3d::Constant(2)}, CELL);
  space.addSurface(mesh);
  return space;
}

} // namespace

TEST(SurfaceGaps, FillAHoleInAnyDirectionAndNothingBeyondTheBorder)
{
  for (int i = 0; i < 5; ++i) {
    const Pose pose(Eigen::AngleAxisd(0.4 * i, Eigen::Vector3d(1, 0.5 * i, -0.3).normalized()));
    const SurfaceMesh mesh = plate(pose);
    const SeenSpace space = spaceOf(mesh);
    const std::vector<std::uint8_t> gaps = findGaps(mesh, space, 1, {});
    int beyond = 0;
    for (std::size_t cell = 0; cell < gaps.size(); ++cell)
      if (gaps[cell]) {
        const Eigen::Vector3d point = pose.inverse() * space.center(cell);
        beyond += point.head<2>().cwiseAbs().maxCoeff() > HOLE + 2 * CELL;
        EXPECT_LT(std::abs(point.z()), HOLE);
      }
    EXPECT_LT(beyond, 8); // of 8 m of border: steps that the grid makes
    for (double x = -HOLE + 2 * CELL; x < HOLE - 2 * CELL; x += CELL)
      for (double y = -HOLE + 2 * CELL; y < HOLE - 2 * CELL; y += CELL)
        EXPECT_TRUE(gaps[*space.find(pose * Eigen::Vector3d(x, y, 0))]) << x << " " << y;
  }
}

TEST(SurfaceGaps, HolesThatAreTooWideOrOutsideOfTheRegionAreNone)
{
  const SurfaceMesh mesh = plate(Pose::Identity());
  const SeenSpace space = spaceOf(mesh);
  const auto count = [](const std::vector<std::uint8_t>& gaps) {
    return std::count(gaps.begin(), gaps.end(), true);
  };
  EXPECT_GT(count(findGaps(mesh, space, 2.5 * HOLE, {})), 50);
  EXPECT_EQ(count(findGaps(mesh, space, 1.5 * HOLE, {})), 0);
  const Eigen::AlignedBox3d elsewhere(Eigen::Vector3d(0.5, -1, -1), Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(count(findGaps(mesh, space, 2.5 * HOLE, elsewhere)), 0);
}

TEST(SurfaceGaps, WhereFreeSpaceBeginsNothingIsMissing)
{
  const SurfaceMesh mesh = plate(Pose::Identity());
  SeenSpace space = spaceOf(mesh);
  space.stand(Eigen::Vector3d::Zero(), 2 * HOLE); // a camera has been put through the hole
  const std::vector<std::uint8_t> gaps = findGaps(mesh, space, 1, {});
  EXPECT_EQ(std::count(gaps.begin(), gaps.end(), true), 0);
}
