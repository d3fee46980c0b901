// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh_checks.h"
#include "messages.h"

#include <bundle_icp/mesh/mesh_cleaning.h>

#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

MeshCleaningOptions
onlyFilling(double perimeter)
{
  MeshCleaningOptions options;
  options.min_component_area = 0;
  options.max_hole_perimeter = perimeter;
  return options;
}

bool
isTop(const Eigen::Vector3f& point)
{
  return point.z() > 0.95f;
}

} // namespace

TEST(MeshCleaning, ASoundMeshStaysAsItIs)
{
  SurfaceMesh mesh = sphereMesh(1, 12);
  const SurfaceMesh before = mesh;
  const MeshCleaningResult result = cleanMesh(mesh, onlyFilling(1));
  EXPECT_EQ(mesh.triangles, before.triangles);
  EXPECT_EQ(mesh.vertices, before.vertices);
  EXPECT_EQ(result.duplicate_vertices + result.degenerate_triangles +
                result.non_manifold_triangles + result.flipped_triangles + result.small_components +
                result.holes_filled,
            0u);
}

TEST(MeshCleaning, ATriangleSoupBecomesASphere)
{
  // Every triangle has its own vertices and half of them look inward; some are there twice, some
  // are a line, one a fin.
  const SurfaceMesh sphere = sphereMesh(1, 12);
  SurfaceMesh soup;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    const auto first = std::uint32_t(soup.vertices.size());
    for (const std::uint32_t vertex : sphere.triangles[t])
      soup.vertices.push_back(sphere.vertices[vertex]);
    soup.triangles.push_back({first, first + 1, first + 2});
    if (t % 2)
      std::swap(soup.triangles.back()[0], soup.triangles.back()[1]);
    if (t % 10 == 0)
      soup.triangles.push_back({first, first + 1, first + 2});
    if (t % 10 == 1)
      soup.triangles.push_back({first, first, first + 2});
  }
  soup.vertices.push_back(0.99f * soup.vertices[0]);
  soup.triangles.push_back({0, 1, std::uint32_t(soup.vertices.size() - 1)});
  soup.vertices.emplace_back(NAN, 0.0f, 0.0f);
  soup.triangles.push_back({0, 1, std::uint32_t(soup.vertices.size() - 1)});

  const MeshCleaningResult result = cleanMesh(soup);
  EXPECT_EQ(result.duplicate_vertices, 3 * sphere.triangles.size() - sphere.vertices.size());
  EXPECT_EQ(result.degenerate_triangles, 2 * ((sphere.triangles.size() + 9) / 10) + 1);
  EXPECT_EQ(result.non_manifold_triangles, 1u);
  EXPECT_EQ(soup.triangles.size(), sphere.triangles.size());
  EXPECT_EQ(soup.vertices.size(), sphere.vertices.size());
  EXPECT_EQ(numOpenEdges(soup), 0u);
  // Without normals a closed surface looks outward.
  EXPECT_NEAR(enclosedVolume(soup), enclosedVolume(sphere), 1e-6);
}

TEST(MeshCleaning, NormalsDecideWhereASurfaceFaces)
{
  SurfaceMesh mesh = squareMesh(5);
  for (auto& triangle : mesh.triangles)
    std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(cleanMesh(mesh).flipped_triangles, mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f a = mesh.vertices[t[0]];
    EXPECT_GT((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).z(), 0);
  }
  expectSound(mesh);
}

TEST(MeshCleaning, AMoebiusStripStaysAsItIs)
{
  constexpr std::uint32_t count = 40;
  SurfaceMesh strip;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float turn = float(2 * M_PI) * i / count;
    const Eigen::Vector3f outwards(std::cos(turn), std::sin(turn), 0);
    const Eigen::Vector3f across =
        0.3f * (std::cos(turn / 2) * outwards + std::sin(turn / 2) * Eigen::Vector3f::UnitZ());
    strip.vertices.push_back(outwards + across);
    strip.vertices.push_back(outwards - across);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool is_seam = i + 1 == count;
    const std::uint32_t a = 2 * i, b = a + 1, c = is_seam ? 1 : a + 2, d = is_seam ? 0 : a + 3;
    strip.triangles.push_back({a, c, b});
    strip.triangles.push_back({b, c, d});
  }
  SurfaceMesh cleaned = strip;
  const MeshCleaningResult result = cleanMesh(cleaned);
  EXPECT_EQ(result.flipped_triangles, 0u);
  EXPECT_EQ(result.non_manifold_triangles, 0u);
  EXPECT_EQ(cleaned.triangles, strip.triangles);
}

TEST(MeshCleaning, SmallAreasGoHoweverFineTheyAre)
{
  for (const int cells : {2, 20}) {
    // A square of 1 m^2 and a sphere of radius 2 cm: 50 cm^2.
    SurfaceMesh mesh = squareMesh(5), ball = sphereMesh(0.02, cells);
    const std::size_t square_triangles = mesh.triangles.size();
    for (auto t : ball.triangles) {
      for (std::uint32_t& vertex : t)
        vertex += std::uint32_t(mesh.vertices.size());
      mesh.triangles.push_back(t);
    }
    mesh.vertices.insert(mesh.vertices.end(), ball.vertices.begin(), ball.vertices.end());
    mesh.normals.insert(mesh.normals.end(), ball.normals.begin(), ball.normals.end());
    mesh.colors.resize(mesh.vertices.size());
    mesh.weights.resize(mesh.vertices.size());
    mesh.deviations.resize(mesh.vertices.size());
    const std::size_t all = mesh.triangles.size();
    MeshCleaningOptions options;
    EXPECT_EQ(cleanMesh(mesh, options).small_components, 0u); // 20 cm^2
    EXPECT_EQ(mesh.triangles.size(), all);
    options.min_component_area = 0.006;
    EXPECT_EQ(cleanMesh(mesh, options).small_components, 1u);
    EXPECT_EQ(mesh.triangles.size(), square_triangles);
    expectSound(mesh);
  }
}

TEST(MeshCleaning, HolesOfASphereAreClosed)
{
  SurfaceMesh mesh = sphereMesh(1, 20);
  const double volume = enclosedVolume(mesh);
  cut(mesh, isTop);
  ASSERT_GT(numOpenEdges(mesh), 10u);
  SurfaceMesh open = mesh;
  EXPECT_EQ(cleanMesh(open, onlyFilling(1)).holes_filled, 0u); // the hole is 2 m around
  EXPECT_GT(numOpenEdges(open), 10u);

  const MeshCleaningResult result = cleanMesh(mesh, onlyFilling(3));
  EXPECT_EQ(result.holes_filled, 1u);
  EXPECT_EQ(numOpenEdges(mesh), 0u);
  expectSound(mesh);
  // The lid is flat: a cap of height 0.05 is missing, pi h^2 (1 - h / 3), or a jag more.
  EXPECT_LT(enclosedVolume(mesh), volume);
  EXPECT_NEAR(enclosedVolume(mesh), volume, 2 * M_PI * 0.05 * 0.05);
  EXPECT_NEAR(result.filled_area, M_PI * (1 - 0.95 * 0.95), 0.1);
}

TEST(MeshCleaning, HolesOfAPlaneAreClosedButNotItsOutline)
{
  const auto isSolid = [](int x, int y) {
    return !(x >= 3 && x < 6 && y >= 3 && y < 5) && !(x == 8 && y == 8) && !(x == 7 && y == 7);
  };
  SurfaceMesh mesh = squareMesh(10, isSolid);
  // Longer than the outline: what lies on the back of the square must not be made. Two holes meet
  // in a vertex.
  const MeshCleaningResult result = cleanMesh(mesh, onlyFilling(100));
  EXPECT_EQ(result.holes_filled, 3u);
  EXPECT_NEAR(result.filled_area, 0.08, 1e-6);
  EXPECT_EQ(numOpenEdges(mesh), 40u);
  expectSound(mesh);
}

TEST(MeshCleaning, WorksOnPclMeshes)
{
  SurfaceMesh mesh = sphereMesh(1, 20);
  cut(mesh, isTop);
  pcl::PolygonMesh polygons = toPolygonMesh(mesh);
  polygons.header.frame_id = "world";
  EXPECT_EQ(cleanMesh(polygons, onlyFilling(5)).holes_filled, 1u);
  cleanMesh(mesh, onlyFilling(5));
  EXPECT_EQ(polygons.header.frame_id, "world");
  expectSame(toSurfaceMesh(polygons), mesh);
}

TEST(MeshCleaning, EmptyMeshesStayEmpty)
{
  SurfaceMesh mesh;
  cleanMesh(mesh, onlyFilling(1));
  EXPECT_TRUE(mesh.vertices.empty() && mesh.triangles.empty());
}

TEST(MeshCleaning, RefusesWhatMakesNoSense)
{
  const auto refusal = [](SurfaceMesh mesh, const MeshCleaningOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { cleanMesh(mesh, options); });
  };
  EXPECT_CONTAINS(refusal({}, onlyFilling(-1)), "max_hole_perimeter -1");
  MeshCleaningOptions options;
  options.min_component_area = NAN;
  EXPECT_CONTAINS(refusal({}, options), "min_component_area nan");
  SurfaceMesh mesh = squareMesh(2);
  mesh.triangles[1][2] = 9;
  EXPECT_CONTAINS(refusal(mesh, {}), "a triangle names vertex 9 of 9");
  mesh = squareMesh(2);
  mesh.weights.pop_back();
  EXPECT_CONTAINS(refusal(mesh, {}), "9 vertices, but 8 weights");
  pcl::PolygonMesh nothing;
  EXPECT_CONTAINS(messageOf<pcl::BadArgumentException>([&] { cleanMesh(nothing); }), "no x, y, z");
}
