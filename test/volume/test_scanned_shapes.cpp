// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/mesh_checks.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/extract_surface.h>

#include <gtest/gtest.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

// What geometry says of the surfaces of whole scans: volume, area and the number of handles.
namespace {

/** Signed distance of a point [m]. */
using Shape = std::function<double(const Eigen::Vector3d& point)>;

/** A shape within half a metre of the origin, found by steps of its distance. */
Intersection
traced(const Shape& shape)
{
  return [shape](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    // Most rays miss the ball that holds the shape.
    const double middle = -ray.dot(origin) / ray.squaredNorm();
    const double apart = (origin + middle * ray).norm(), reach = 0.5;
    if (!(apart < reach))
      return none;
    const double length = ray.norm();
    const double half = std::sqrt(reach * reach - apart * apart) / length;
    for (double t = middle - half; t < middle + half;) {
      const double distance = shape(origin + t * ray);
      if (distance < 1e-5)
        return t;
      t += distance / length;
    }
    return none;
  };
}

Shape
ball(const Eigen::Vector3d& center, double radius)
{
  return [=](const Eigen::Vector3d& p) { return (p - center).norm() - radius; };
}

/** A ring around the z axis. */
Shape
torus(double radius, double tube)
{
  return [=](const Eigen::Vector3d& p) {
    return std::hypot(p.head<2>().norm() - radius, p.z()) - tube;
  };
}

/** What cameras all around see of a shape. */
std::vector<RGBDFrame>
viewsOf(const Shape& shape)
{
  std::vector<RGBDFrame> frames;
  for (const Pose& pose : posesAllAround(1.0))
    frames.push_back(render(traced(shape), pose));
  return frames;
}

TSDFVolume
fuse(const std::vector<RGBDFrame>& frames, const Pose& world_from_shape = Pose::Identity())
{
  TSDFVolume volume(coarseOptions());
  const std::vector<Pose> poses = posesAllAround(1.0);
  for (std::size_t i = 0; i < frames.size(); ++i)
    volume.integrate(frames[i], smallCamera(), world_from_shape * poses[i]);
  return volume;
}

SurfaceMesh
scan(const Shape& shape)
{
  return extractSurface(fuse(viewsOf(shape)));
}

/** V - E + F of a closed mesh: 2 for each component, 2 less for each handle. */
int
eulerCharacteristic(const SurfaceMesh& mesh)
{
  EXPECT_EQ(numOpenEdges(mesh), 0u);
  const std::size_t edges = directedEdges(mesh).size() / 2;
  return int(mesh.vertices.size()) - int(edges) + int(mesh.triangles.size());
}

double
areaOf(const SurfaceMesh& mesh)
{
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[t[0]];
    area += (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm() / 2;
  }
  return area;
}

Eigen::Vector3d
centroid(const SurfaceMesh& mesh)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    sum += vertex.cast<double>();
  return sum / double(mesh.vertices.size());
}

const double RING = 0.25, TUBE = 0.1;

} // namespace

TEST(ScannedShapes, ABallHasOneComponentItsAreaAndItsVolume)
{
  const double radius = 0.3;
  const SurfaceMesh mesh = scan(ball({0, 0, 0}, radius));
  expectSound(mesh);
  EXPECT_EQ(eulerCharacteristic(mesh), 2);
  const double area = 4 * M_PI * radius * radius;
  EXPECT_NEAR(areaOf(mesh) / area, 1, 0.01);
  EXPECT_NEAR(enclosedVolume(mesh) / (area * radius / 3), 1, 0.01);
}

TEST(ScannedShapes, ARingHasOneHandle)
{
  const SurfaceMesh mesh = scan(torus(RING, TUBE));
  expectSound(mesh);
  EXPECT_EQ(eulerCharacteristic(mesh), 0);
  // Pappus: the tube's circle times the way of its centre.
  EXPECT_NEAR(areaOf(mesh) / (2 * M_PI * TUBE * 2 * M_PI * RING), 1, 0.02);
  EXPECT_NEAR(enclosedVolume(mesh) / (M_PI * TUBE * TUBE * 2 * M_PI * RING), 1, 0.02);
}

TEST(ScannedShapes, TwoBallsAreTwoComponents)
{
  const Shape left = ball({-0.2, 0, 0}, 0.15), right = ball({0.2, 0.05, 0}, 0.1);
  const SurfaceMesh mesh =
      scan([=](const Eigen::Vector3d& p) { return std::min(left(p), right(p)); });
  EXPECT_EQ(eulerCharacteristic(mesh), 4);
  const double volume = 4.0 / 3 * M_PI * (std::pow(0.15, 3) + std::pow(0.1, 3));
  EXPECT_NEAR(enclosedVolume(mesh) / volume, 1, 0.02);
}

TEST(ScannedShapes, FollowTheWorldByWholeVoxels)
{
  // Apart from the rounding to 16 bits, which is drawn anew for each block.
  const Shape shape = ball({0.013, -0.021, 0.034}, 0.2);
  const Eigen::Vector3d shift = coarseOptions().voxel_size * Eigen::Vector3d(3, -120, 517);
  const std::vector<RGBDFrame> views = viewsOf(shape);
  const SurfaceMesh here = extractSurface(fuse(views));
  const SurfaceMesh there = extractSurface(fuse(views, Pose(Eigen::Translation3d(shift))));
  EXPECT_NEAR(double(there.vertices.size()), double(here.vertices.size()),
              0.002 * double(here.vertices.size()));
  EXPECT_NEAR(areaOf(there), areaOf(here), 1e-4 * areaOf(here));
  EXPECT_LT((centroid(there) - centroid(here) - shift).norm(), 1e-4);
  for (const Eigen::Vector3f& vertex : there.vertices)
    ASSERT_NEAR(shape(vertex.cast<double>() - shift), 0, 0.005);
}

TEST(ScannedShapes, FollowQuarterTurnsOfTheWorld)
{
  // These bring the grid to itself.
  const std::vector<RGBDFrame> views = viewsOf(torus(RING, TUBE));
  const SurfaceMesh straight = extractSurface(fuse(views));
  for (int axis = 0; axis < 3; ++axis) {
    const Pose turn(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::Unit(axis)));
    const SurfaceMesh turned = extractSurface(fuse(views, turn));
    EXPECT_EQ(eulerCharacteristic(turned), 0);
    EXPECT_NEAR(areaOf(turned), areaOf(straight), 2e-4 * areaOf(straight));
    EXPECT_NEAR(enclosedVolume(turned), enclosedVolume(straight), 2e-4 * enclosedVolume(straight));
  }
}

TEST(ScannedShapes, GrowByTheIsoLevel)
{
  // Distances are along the optical axis: the larger ball is at most that much larger.
  const double radius = 0.25;
  const TSDFVolume volume = fuse(viewsOf(ball({0, 0, 0}, radius)));
  MeshOptions options;
  double before = 0;
  for (const double level : {0.0, 0.2, 0.4}) {
    options.iso_level = level;
    const SurfaceMesh mesh = extractSurface(volume, options);
    const double mean = std::cbrt(3 * enclosedVolume(mesh) / (4 * M_PI));
    EXPECT_LT(mean, radius + level * 0.04 + 0.001);
    EXPECT_GT(mean, radius + level * 0.04 * 0.5 - 0.001);
    EXPECT_GT(mean, before);
    before = mean;
  }
}
