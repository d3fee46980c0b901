// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/evaluation/surface_error.h>

#include "messages.h"

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/exceptions.h>

#include <cmath>
#include <limits>

using namespace bundle_icp;

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// A rectangle of width x 1 m in the plane z = height, of two triangles.
pcl::PolygonMesh
rectangle(float width, float height)
{
  Cloud vertices;
  for (const auto& [x, y] : {std::make_pair(0.f, 0.f), std::make_pair(width, 0.f),
                             std::make_pair(width, 1.f), std::make_pair(0.f, 1.f)})
    vertices.push_back(pcl::PointXYZ(x, y, height));
  pcl::PolygonMesh mesh;
  pcl::toPCLPointCloud2(vertices, mesh.cloud);
  mesh.polygons.resize(2);
  mesh.polygons[0].vertices = {0, 1, 2};
  mesh.polygons[1].vertices = {0, 2, 3};
  return mesh;
}

// Points of the unit square in the plane z = 0, 5 mm apart, cell by cell in the middle.
Cloud
unitSquare()
{
  Cloud cloud;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x)
      cloud.push_back(pcl::PointXYZ(0.005f * (x + 0.5f), 0.005f * (y + 0.5f), 0));
  return cloud;
}

double
distanceToPlane(const Eigen::Vector3d& point)
{
  return std::abs(point.z());
}

} // namespace

TEST(SurfaceError, OfAPlaneThreeMillimetresOff)
{
  SurfaceErrorOptions options;
  options.distance_to_truth = distanceToPlane;
  const SurfaceError error = surfaceError(rectangle(1, 0.003f), unitSquare(), options);
  EXPECT_NEAR(error.accuracy.mean, 0.003, 1e-6);
  EXPECT_NEAR(error.accuracy.rmse, 0.003, 1e-6);
  EXPECT_NEAR(double(error.accuracy.count), 1.0 / (0.005 * 0.005),
              2); // one per 25 mm^2
  EXPECT_EQ(error.completeness, 1);
}

TEST(SurfaceError, ThroughPointsAddsTheirSpacing)
{
  const SurfaceError error = surfaceError(rectangle(1, 0), unitSquare());
  // Mean distance in a 5 mm cell to its middle: 0.3826 * 5 mm.
  EXPECT_NEAR(error.accuracy.mean, 0.3826 * 0.005, 2e-5);
  EXPECT_LT(error.accuracy.max, 0.005 / std::sqrt(2) + 1e-5);
}

TEST(SurfaceError, HalfOfTheSurfaceIsHalfComplete)
{
  SurfaceErrorOptions options;
  options.distance_to_truth = distanceToPlane;
  const SurfaceError half = surfaceError(rectangle(0.5f, 0), unitSquare(), options);
  EXPECT_NEAR(half.completeness, 0.51, 0.006); // half a metre and the 1 cm beside it
  EXPECT_NEAR(half.accuracy.max, 0, 1e-9);     // what is there is right
  const SurfaceError off = surfaceError(rectangle(1, 0.011f), unitSquare(), options);
  EXPECT_EQ(off.completeness, 0);
  options.completeness_distance = 0.02;
  EXPECT_EQ(surfaceError(rectangle(1, 0.011f), unitSquare(), options).completeness, 1);
}

TEST(SurfaceError, AppliesTheAlignmentAndIgnoresThreads)
{
  Vector6d motion;
  motion << 0.1, 0.7, -0.4, 1, 2, 3;
  const Pose estimate_from_truth = increment(motion);
  pcl::PolygonMesh mesh = rectangle(1, 0.003f);
  Cloud vertices;
  pcl::fromPCLPointCloud2(mesh.cloud, vertices);
  for (pcl::PointXYZ& vertex : vertices)
    vertex.getVector3fMap() =
        (estimate_from_truth * vertex.getVector3fMap().cast<double>()).cast<float>();
  pcl::toPCLPointCloud2(vertices, mesh.cloud);

  SurfaceErrorOptions options;
  options.truth_from_estimate = estimate_from_truth.inverse();
  options.num_threads = 1;
  const SurfaceError one = surfaceError(mesh, unitSquare(), options);
  options.num_threads = 3;
  const SurfaceError three = surfaceError(mesh, unitSquare(), options);
  EXPECT_EQ(one.accuracy.mean, three.accuracy.mean);
  EXPECT_EQ(one.accuracy.rmse, three.accuracy.rmse);
  EXPECT_EQ(one.completeness, 1);
  const SurfaceError direct = surfaceError(rectangle(1, 0.003f), unitSquare());
  EXPECT_NEAR(one.accuracy.mean, direct.accuracy.mean, 1e-5);
}

TEST(SurfaceError, PolygonsAreFansAndSizesOfTrianglesDoNotMatter)
{
  SurfaceErrorOptions options;
  // A quarter of the area lies 2 mm off, in one quad; the rest is exact, in two
  // triangles.
  pcl::PolygonMesh mesh = rectangle(0.75f, 0);
  Cloud vertices;
  pcl::fromPCLPointCloud2(mesh.cloud, vertices);
  for (const auto& [x, y] : {std::make_pair(0.75f, 0.f), std::make_pair(1.f, 0.f),
                             std::make_pair(1.f, 1.f), std::make_pair(0.75f, 1.f)})
    vertices.push_back(pcl::PointXYZ(x, y, 0.002f));
  pcl::toPCLPointCloud2(vertices, mesh.cloud);
  mesh.polygons.resize(3);
  mesh.polygons[2].vertices = {4, 5, 6, 7};
  options.distance_to_truth = distanceToPlane;
  EXPECT_NEAR(surfaceError(mesh, unitSquare(), options).accuracy.mean, 0.0005, 1e-6);
}

TEST(SurfaceError, RefusesWhatCannotBeCompared)
{
  const auto error = [](const pcl::PolygonMesh& mesh, const Cloud& surface,
                        const SurfaceErrorOptions& options = {}) {
    return messageOf<pcl::BadArgumentException>([&] { surfaceError(mesh, surface, options); });
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Cloud empty;
  empty.push_back(pcl::PointXYZ(nan, nan, nan));
  EXPECT_CONTAINS(error(rectangle(1, 0), empty), "no finite point");
  pcl::PolygonMesh mesh = rectangle(1, 0);
  mesh.polygons[1].vertices[2] = 4;
  EXPECT_CONTAINS(error(mesh, unitSquare()), "names vertex 4 of 4");
  EXPECT_CONTAINS(error(rectangle(nan, 0), unitSquare()), "has a vertex that is not finite");
  EXPECT_CONTAINS(error(rectangle(1e20f, 0), unitSquare()), "more area than 1e8 samples cover");
  mesh.polygons.clear();
  EXPECT_CONTAINS(error(mesh, unitSquare()), "no area");
  EXPECT_CONTAINS(error(pcl::PolygonMesh(), unitSquare()), "no field x");

  SurfaceErrorOptions options;
  options.completeness_distance = 0;
  EXPECT_CONTAINS(error(rectangle(1, 0), unitSquare(), options), "completeness_distance");
  options = {};
  options.sample_spacing = 0.006;
  EXPECT_CONTAINS(error(rectangle(1, 0), unitSquare(), options), "sample_spacing");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(error(rectangle(1, 0), unitSquare(), options), "num_threads");
  options = {};
  options.truth_from_estimate.linear() *= 2;
  EXPECT_CONTAINS(error(rectangle(1, 0), unitSquare(), options), "not a rigid motion");
}
