// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh_checks.h"
#include "messages.h"

#include <bundle_icp/mesh/mesh_decimation.h>

#include <pcl/exceptions.h>

#include <random>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

MeshDecimationOptions
toTriangles(std::size_t triangles)
{
  MeshDecimationOptions options;
  options.max_triangles = triangles;
  return options;
}

MeshDecimationOptions
withinError(double error)
{
  MeshDecimationOptions options;
  options.max_error = error;
  return options;
}

/** Least and largest distance of points on the triangles from the origin. */
std::pair<double, double>
radii(const SurfaceMesh& mesh)
{
  double least = 1e9, largest = 0;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i <= 8; ++i)
      for (int j = 0; i + j <= 8; ++j) {
        const Eigen::Vector3f point =
            (float(i) * mesh.vertices[t[0]] + float(j) * mesh.vertices[t[1]] +
             float(8 - i - j) * mesh.vertices[t[2]]) /
            8;
        least = std::min(least, double(point.norm()));
        largest = std::max(largest, double(point.norm()));
      }
  return {least, largest};
}

} // namespace

TEST(MeshDecimation, ASphereStaysOneWithinTheStatedError)
{
  const SurfaceMesh sphere = sphereMesh(1, 40);
  for (const std::size_t goal : {2000u, 200u}) {
    SurfaceMesh mesh = sphere;
    const MeshDecimationResult result = decimateMesh(mesh, toTriangles(goal));
    EXPECT_EQ(result.triangles_before, sphere.triangles.size());
    EXPECT_EQ(result.triangles_after, mesh.triangles.size());
    EXPECT_LE(mesh.triangles.size(), goal);
    EXPECT_GE(mesh.triangles.size(), goal - 1);
    expectSound(mesh);
    EXPECT_EQ(numOpenEdges(mesh), 0u);
    EXPECT_NEAR(enclosedVolume(mesh), 4 * M_PI / 3, 0.15 * std::sqrt(200.0 / double(goal)));
    // The sphere before is itself off by 1 - cos of half a cell's diagonal.
    const auto [least, largest] = radii(mesh);
    const double own_error = 1 - radii(sphere).first;
    EXPECT_GT(least, 1 - result.statedError() - own_error);
    EXPECT_LT(largest, 1 + result.statedError());
    // Triangles of this size on a unit sphere cannot do better than half their sagitta, and
    // the simplification of a smooth surface should not do much worse.
    const double sagitta = 4 * M_PI / double(goal) / (2 * std::sqrt(3.0));
    EXPECT_GT(result.statedError(), 0.3 * sagitta);
    EXPECT_LT(result.statedError(), 4 * sagitta);
    EXPECT_LT(result.rms_error, result.max_error);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      EXPECT_GT(mesh.normals[i].dot(mesh.vertices[i].normalized()), 0.97f);
  }
}

TEST(MeshDecimation, NoVertexGetsFartherThanTheLimit)
{
  SurfaceMesh coarse = sphereMesh(1, 30), fine = coarse;
  const MeshDecimationResult rough = decimateMesh(coarse, withinError(0.02)),
                             exact = decimateMesh(fine, withinError(0.002));
  EXPECT_LE(rough.max_error, 0.02);
  EXPECT_LE(exact.max_error, 0.002);
  EXPECT_GT(rough.max_error, 0.01); // the limit is made use of
  EXPECT_LT(rough.triangles_after, exact.triangles_after / 3);
  EXPECT_LT(exact.triangles_after, exact.triangles_before / 2);
  expectSound(coarse);
  expectSound(fine);
}

TEST(MeshDecimation, APlaneLosesNothingButTriangles)
{
  // With an L-shaped hole: outline and hole are kept to the last corner.
  const auto isSolid = [](int x, int y) {
    return !(x >= 5 && x < 9 && y >= 5 && y < 15) && !(x >= 5 && x < 15 && y >= 5 && y < 9);
  };
  SurfaceMesh mesh = squareMesh(20, isSolid);
  const std::size_t before = mesh.triangles.size();
  const MeshDecimationResult result = decimateMesh(mesh, withinError(1e-5));
  EXPECT_LE(result.statedError(), 1e-5);
  EXPECT_LT(mesh.triangles.size(), before / 10);
  expectSound(mesh);
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f a = mesh.vertices[t[0]];
    area += 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).z();
  }
  EXPECT_NEAR(area, 1 - 64 / 400.0, 1e-5);
  for (const auto& corner : {Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(1, 0, 0),
                             Eigen::Vector3f(0.25f, 0.75f, 0), Eigen::Vector3f(0.45f, 0.45f, 0)})
    EXPECT_TRUE(std::any_of(mesh.vertices.begin(), mesh.vertices.end(), [&](const auto& vertex) {
      return (vertex - corner).norm() < 1e-6f;
    })) << corner.transpose();
}

TEST(MeshDecimation, CarriesWhatIsKnownOfVertices)
{
  SurfaceMesh mesh = squareMesh(20);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.weights[i] = 1 + mesh.vertices[i].x();
    mesh.deviations[i] = 0.001f * (1 + mesh.vertices[i].y());
    mesh.colors[i] = {std::uint8_t(200 * mesh.vertices[i].x()), 7, 255};
  }
  decimateMesh(mesh, toTriangles(200));
  expectSound(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_NEAR(mesh.weights[i], 1 + mesh.vertices[i].x(), 0.05);
    EXPECT_NEAR(mesh.deviations[i], 0.001f * (1 + mesh.vertices[i].y()), 5e-5);
    EXPECT_NEAR(mesh.colors[i][0], 200 * mesh.vertices[i].x(), 12);
    EXPECT_EQ(mesh.colors[i][1], 7);
  }
}

TEST(MeshDecimation, StatesTheErrorOfARoughSurface)
{
  // Noise of 1 cm cannot be represented by few triangles, and must be stated.
  SurfaceMesh mesh = squareMesh(40);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> noise(-0.01f, 0.01f);
  for (Eigen::Vector3f& vertex : mesh.vertices)
    vertex.z() = noise(random);
  const MeshDecimationResult result = decimateMesh(mesh, toTriangles(100));
  EXPECT_GT(result.max_error, 0.007);
  EXPECT_LT(result.statedError(), 0.03);
  EXPECT_NEAR(result.rms_error, 0.01 / std::sqrt(3.0), 0.002);
  expectSound(mesh);
}

TEST(MeshDecimation, LeavesSmallThingsAlone)
{
  // A tetrahedron has nothing to spare, and a mesh below the goal is not touched.
  SurfaceMesh tetrahedron;
  tetrahedron.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  EXPECT_EQ(decimateMesh(tetrahedron, withinError(10)).triangles_after, 4u);
  EXPECT_EQ(numOpenEdges(tetrahedron), 0u);
  SurfaceMesh mesh = squareMesh(5);
  const SurfaceMesh before = mesh;
  EXPECT_EQ(decimateMesh(mesh, toTriangles(50)).statedError(), 0);
  EXPECT_EQ(mesh.triangles, before.triangles);
  EXPECT_EQ(decimateMesh(mesh, MeshDecimationOptions()).triangles_after, 50u);
  SurfaceMesh empty;
  EXPECT_EQ(decimateMesh(empty, toTriangles(1)).triangles_after, 0u);
}

TEST(MeshDecimation, IsTheSameEachTimeAndForPclMeshes)
{
  SurfaceMesh first = sphereMesh(1, 15), second = first;
  pcl::PolygonMesh third = toPolygonMesh(first);
  decimateMesh(first, toTriangles(300));
  decimateMesh(second, toTriangles(300));
  decimateMesh(third, toTriangles(300));
  EXPECT_EQ(first.triangles, second.triangles);
  EXPECT_EQ(first.vertices, second.vertices);
  EXPECT_EQ(first.vertices, toSurfaceMesh(third).vertices);
}

TEST(MeshDecimation, RefusesWhatMakesNoSense)
{
  SurfaceMesh mesh = squareMesh(2);
  const auto refusal = [&mesh](const MeshDecimationOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { decimateMesh(mesh, options); });
  };
  EXPECT_CONTAINS(refusal(withinError(-0.5)), "max_error -0.5");
  mesh.vertices[3].x() = INFINITY;
  EXPECT_CONTAINS(refusal(withinError(1)), "vertex 3 is not finite");
  mesh.colors.clear();
  mesh.normals.pop_back();
  EXPECT_CONTAINS(refusal(withinError(1)), "9 vertices, but 8 normals");
}
