// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_checks.h"
#include "messages.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/extract_surface.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <set>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double radius = 0.3;
constexpr double voxel = 0.01;

TSDFVolume
fuse(const Intersection& scene, const std::vector<Pose>& poses, const Paint& paint)
{
  TSDFOptions options;
  options.voxel_size = voxel;
  options.truncation = 0.04;
  TSDFVolume volume(options);
  for (const Pose& pose : poses)
    volume.integrate(render(scene, pose, paint), smallCamera(), pose);
  return volume;
}

const Paint gray = [](const Eigen::Vector3d&) { return cv::Vec3b(128, 128, 128); };

MeshOptions
everything()
{
  MeshOptions options;
  options.cleaning.min_component_area = 0;
  return options;
}

std::array<Eigen::Vector3d, 3>
corners(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& triangle)
{
  return {mesh.vertices[triangle[0]].cast<double>(), mesh.vertices[triangle[1]].cast<double>(),
          mesh.vertices[triangle[2]].cast<double>()};
}

double
smallestArea(const SurfaceMesh& mesh)
{
  double smallest = 1e9;
  for (const auto& triangle : mesh.triangles) {
    const auto p = corners(mesh, triangle);
    smallest = std::min(smallest, (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2);
  }
  return smallest;
}

std::size_t
numDistinctVertices(const SurfaceMesh& mesh)
{
  std::set<std::array<float, 3>> distinct;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    distinct.insert({vertex.x(), vertex.y(), vertex.z()});
  return distinct.size();
}

CameraIntrinsics
usualCamera()
{
  CameraIntrinsics camera = smallCamera();
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

} // namespace

TEST(ExtractSurface, SphereIsAccurateClosedAndFacesOutward)
{
  const TSDFVolume volume = fuse(sphere(radius), posesAllAround(1.0), gray);
  const SurfaceMesh mesh = extractSurface(volume);
  ASSERT_GT(mesh.triangles.size(), 10000u);
  EXPECT_EQ(mesh.normals.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());

  double sum = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const double error = std::abs(mesh.vertices[i].cast<double>().norm() - radius);
    EXPECT_LT(error, voxel / 2);
    sum += error;
    EXPECT_GT(mesh.normals[i].dot(mesh.vertices[i].normalized()), 0.95f);
    EXPECT_NEAR(mesh.normals[i].norm(), 1, 1e-5);
  }
  EXPECT_LT(sum / double(mesh.vertices.size()), voxel / 20);

  // The neighbour runs along a shared edge the other way round.
  const auto edges = directedEdges(mesh);
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.count({edge.second, edge.first}));
  }
  double enclosed = 0;
  for (const auto& triangle : mesh.triangles) {
    const auto p = corners(mesh, triangle);
    enclosed += p[0].dot(p[1].cross(p[2])) / 6;
  }
  EXPECT_NEAR(enclosed, 4.0 / 3 * M_PI * std::pow(radius, 3), 0.01 * enclosed);
}

TEST(ExtractSurface, SharesVerticesAndHasNoTriangleWithoutArea)
{
  // The wall runs exactly through voxel centres: every vertex is one where marching
  // cubes wants to put several into one place.
  const std::vector<Pose> front{Pose::Identity()};
  for (const double offset : {1.0, 1.0025}) {
    const SurfaceMesh mesh =
        extractSurface(fuse(plane({0, 0, 1}, offset), front, gray), everything());
    ASSERT_GT(mesh.triangles.size(), 1000u);
    EXPECT_EQ(numDistinctVertices(mesh), mesh.vertices.size());
    EXPECT_GT(smallestArea(mesh), 1e-9);
    std::vector<bool> used(mesh.vertices.size());
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t vertex : triangle)
        used[vertex] = true;
    EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
  }
}

TEST(ExtractSurface, NoiseTearsNoHolesIntoTheInside)
{
  // Every case of marching cubes occurs in noise; open edges may only be where
  // observation ends.
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.012f);
  RGBDFrame frame = render(plane({0, 0, 1}, 1.0), Pose::Identity());
  for (auto z = frame.depth.begin<float>(); z != frame.depth.end<float>(); ++z)
    *z += noise(random);
  TSDFOptions options;
  options.voxel_size = 0.004;
  options.truncation = 0.1;
  CameraIntrinsics camera = smallCamera();
  camera.depth_noise.constant = 0.02;
  TSDFVolume volume(options);
  volume.integrate(frame, camera, Pose::Identity());
  const SurfaceMesh mesh = extractSurface(volume, everything());
  ASSERT_GT(mesh.triangles.size(), 10000u);
  EXPECT_EQ(numDistinctVertices(mesh), mesh.vertices.size());
  const auto edges = directedEdges(mesh);
  int open = 0;
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    const Eigen::Vector3f middle = (mesh.vertices[edge.first] + mesh.vertices[edge.second]) / 2;
    if (std::abs(middle.x()) < 0.5f && std::abs(middle.y()) < 0.35f &&
        std::abs(middle.z() - 1) < 0.06f)
      open += back == edges.end() || back->second != count;
  }
  EXPECT_EQ(open, 0);
}

TEST(ExtractSurface, ColorsDoNotSmear)
{
  // Red left of x = 0.0025, blue right of it.
  const Paint two = [](const Eigen::Vector3d& point) {
    return point.x() < 0.0025 ? cv::Vec3b(0, 0, 250) : cv::Vec3b(250, 0, 0);
  };
  std::vector<Pose> poses;
  for (const double x : {-0.3, -0.1, 0.1, 0.3})
    poses.push_back(lookAt({x, 0.1, 0}, {0, 0, 1}));
  const SurfaceMesh mesh = extractSurface(fuse(plane({0, 0, 1}, 1.0), poses, two), everything());
  ASSERT_GT(mesh.vertices.size(), 1000u);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const double side = mesh.vertices[i].x() - 0.0025;
    if (std::abs(side) < 1.5 * voxel)
      continue;
    EXPECT_NEAR(mesh.colors[i][0], side < 0 ? 250 : 0, 3);
    EXPECT_NEAR(mesh.colors[i][2], side < 0 ? 0 : 250, 3);
    EXPECT_LE(mesh.colors[i][1], 3);
  }
}

TEST(ExtractSurface, SmallAreasAreRemovedUnlessAskedFor)
{
  // A ball of radius 6 mm seen from one side, in front of a wall. With the rim that what is hidden
  // behind it leaves, some 12 cm^2.
  const Intersection scene = [](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const double ball = sphere(0.006)(origin - Eigen::Vector3d(0, 0, 1), ray);
    return std::isnan(ball) ? plane({0, 0, 1}, 1.3)(origin, ray) : ball;
  };
  const CameraIntrinsics camera = usualCamera();
  TSDFVolume volume;
  volume.integrate(render(scene, Pose::Identity(), gray, camera), camera, Pose::Identity());
  MeshReport report;
  const SurfaceMesh clean = extractSurface(volume, {}, &report);
  EXPECT_GE(report.cleaning.small_components, 1u);
  EXPECT_GT(extractSurface(volume, everything()).vertices.size(), clean.vertices.size());
  for (const Eigen::Vector3f& vertex : clean.vertices)
    EXPECT_GT(vertex.z(), 1.15f);
}

TEST(ExtractSurface, FillsAndDecimatesWhenAskedTo)
{
  const TSDFVolume volume = fuse(sphere(radius), posesAllAround(1.0), gray);
  MeshOptions options;
  options.decimation.max_error = 0.001;
  MeshReport report;
  const SurfaceMesh mesh = extractSurface(volume, options, &report);
  EXPECT_EQ(report.decimation.triangles_before, extractSurface(volume).triangles.size());
  EXPECT_EQ(report.decimation.triangles_after, mesh.triangles.size());
  EXPECT_LT(mesh.triangles.size(), report.decimation.triangles_before / 4);
  EXPECT_LE(report.decimation.max_error, 0.001);
  expectSound(mesh);
  EXPECT_EQ(numOpenEdges(mesh), 0u);
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    EXPECT_NEAR(vertex.norm(), radius, voxel / 2 + report.decimation.statedError());
}

namespace {

// A camera of usual resolution looks at the wall slant x + z = offset from ever new places, with
// noise of which half is shared by neighbouring pixels, fused with that radius of smoothing [px].
// \return RMS of errors along the normal, each over its standard deviation.
double
normalisedError(int smoothing, int frames, double slant, double offset)
{
  const CameraIntrinsics camera = usualCamera();
  std::mt19937 random(11);
  std::normal_distribution<float> noise(0, std::sqrt(0.5f));
  TSDFOptions options;
  options.smoothing_radius = smoothing;
  TSDFVolume volume(options);
  for (int f = 0; f < frames; ++f) {
    const Pose pose(Eigen::Translation3d(0.003 * f, 0.002 * f, 0.001 * f));
    RGBDFrame frame = render(plane({slant, 0, 1}, offset), pose, gray, camera);
    cv::Mat shared(480 / 3 + 1, 640 / 3 + 1, CV_32FC1);
    for (auto z = shared.begin<float>(); z != shared.end<float>(); ++z)
      *z = noise(random);
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        float& z = frame.depth.at<float>(v, u);
        z += float(camera.depth_noise.sigma(z)) * (noise(random) + shared.at<float>(v / 3, u / 3));
      }
    volume.integrate(frame, camera, pose);
  }
  const SurfaceMesh mesh = extractSurface(volume);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p = mesh.vertices[i].cast<double>();
    // At the border of the image the window of smoothing is cut.
    if (std::max(std::abs(p.x()), std::abs(p.y())) > 0.4 * p.z())
      continue;
    EXPECT_GT(mesh.deviations[i], 0);
    const double error = (slant * p.x() + p.z() - offset) / std::sqrt(1 + slant * slant);
    sum += std::pow(error / mesh.deviations[i], 2);
    ++count;
  }
  EXPECT_GT(count, 5000u);
  return std::sqrt(sum / double(count));
}

} // namespace

TEST(ExtractSurface, StandardDeviationsAreThoseOfTheErrors)
{
  // Near and far, frontal and slanted, few frames and more, smoothed and not: the deviations
  // themselves differ by a factor of thirty.
  const double cases[][3] = {{1, 0, 0.8}, {5, 0, 1.0}, {2, 0.8, 0.8}, {2, 0.4, 2.0}};
  for (const int smoothing : {0, 2, 6, 10})
    for (const auto& [frames, slant, offset] : cases) {
      const double normalised = normalisedError(smoothing, int(frames), slant, offset);
      EXPECT_GT(normalised, 0.4) << smoothing << " px, " << frames << " frames, slant " << slant
                                 << ", " << offset << " m";
      EXPECT_LT(normalised, 1.5) << smoothing << " px, " << frames << " frames, slant " << slant
                                 << ", " << offset << " m";
    }
}

TEST(ExtractSurface, SlantedWallsHaveNoHoles)
{
  // The more a wall is slanted, the farther behind it along the optical axis are the voxels
  // that marching cubes need. 74 degrees from frontal in the middle of the image.
  const CameraIntrinsics camera = usualCamera();
  TSDFVolume volume;
  volume.integrate(render(plane({3, 0, 1}, 1.2), Pose::Identity(), gray, camera), camera,
                   Pose::Identity());
  const SurfaceMesh mesh = extractSurface(volume);
  const auto is_inside = [&mesh](std::uint32_t vertex) {
    const Eigen::Vector3f& p = mesh.vertices[vertex];
    return std::abs(p.x()) < 0.05f * p.z() && std::abs(p.y()) < 0.3f * p.z();
  };
  const DirectedEdges edges = directedEdges(mesh);
  std::size_t count = 0;
  for (const auto& [edge, times] : edges) {
    const auto& [from, to] = edge;
    if (!is_inside(from))
      continue;
    ++count;
    EXPECT_EQ(edges.count({to, from}), 1u) << mesh.vertices[from].transpose();
  }
  EXPECT_GT(count, 10000u);
}

TEST(ExtractSurface, WeightsCountFrontalMeasurementsAtOneMetre)
{
  const std::vector<Pose> once{Pose::Identity()}, fourfold(4, Pose::Identity());
  const auto middleWeight = [](const SurfaceMesh& mesh) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      if (mesh.vertices[i].head<2>().norm() < 0.1f) {
        sum += mesh.weights[i];
        ++count;
      }
    return sum / count;
  };
  const double one = middleWeight(extractSurface(fuse(plane({0, 0, 1}, 1.0), once, gray)));
  const double four = middleWeight(extractSurface(fuse(plane({0, 0, 1}, 1.0), fourfold, gray)));
  EXPECT_NEAR(one, 1, 0.1);
  EXPECT_NEAR(four, 4, 0.4);
}

TEST(ExtractSurface, IsTheSameForAnyNumberOfThreads)
{
  const TSDFVolume volume = fuse(sphere(radius), posesAllAround(1.0), gray);
  MeshOptions options;
  options.num_threads = 1;
  const SurfaceMesh one = extractSurface(volume, options);
  ASSERT_GT(one.vertices.size(), 1000u);
  options.num_threads = 3;
  expectSame(one, extractSurface(volume, options));
}

TEST(ExtractSurface, IsTheSameFromAVolumeThatIsGivenUp)
{
  TSDFVolume volume = fuse(sphere(radius), posesAllAround(1.0), gray);
  const SurfaceMesh kept = extractSurface(volume);
  ASSERT_GT(kept.vertices.size(), 1000u);
  expectSame(kept, extractSurface(std::move(volume)));
}

TEST(ExtractSurface, MinimumWeightDropsWhatWasSeenOnce)
{
  const TSDFVolume volume = fuse(plane({0, 0, 1}, 1.0), {Pose::Identity()}, gray);
  MeshOptions options;
  EXPECT_GT(extractSurface(volume, options).triangles.size(), 1000u);
  options.min_weight = 2; // one frame at 1 m weighs at most 1
  EXPECT_EQ(extractSurface(volume, options).triangles.size(), 0u);
}

TEST(ExtractSurface, IsoLevelMovesTheSurfaceTowardsTheCamera)
{
  const TSDFVolume volume = fuse(plane({0, 0, 1}, 1.0), {Pose::Identity()}, gray);
  MeshOptions options;
  options.iso_level = 0.5;
  const SurfaceMesh mesh = extractSurface(volume, options);
  ASSERT_GT(mesh.vertices.size(), 1000u);
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    EXPECT_NEAR(vertex.z(), 0.98, voxel / 2);
}

TEST(ExtractSurface, EmptyVolumeGivesAnEmptyMesh)
{
  const SurfaceMesh mesh = extractSurface(TSDFVolume());
  EXPECT_TRUE(mesh.vertices.empty() && mesh.triangles.empty());
}

TEST(ExtractSurface, RefusesBadOptions)
{
  const TSDFVolume volume;
  const auto refusal = [&volume](const MeshOptions& options) {
    return messageOf<pcl::BadArgumentException>([&] { extractSurface(volume, options); });
  };
  MeshOptions options;
  options.min_weight = 0;
  EXPECT_CONTAINS(refusal(options), "min_weight 0");
  options = {};
  options.iso_level = 1;
  EXPECT_CONTAINS(refusal(options), "iso_level 1");
  options.iso_level = -0.1;
  EXPECT_CONTAINS(refusal(options), "iso_level -0.1");
  options = {};
  options.num_threads = -2;
  EXPECT_CONTAINS(refusal(options), "num_threads -2");
  options = {};
  options.cleaning.max_hole_perimeter = -1;
  EXPECT_CONTAINS(refusal(options), "max_hole_perimeter -1");
  options = {};
  options.decimation.max_error = -1;
  EXPECT_CONTAINS(refusal(options), "max_error -1");
}
