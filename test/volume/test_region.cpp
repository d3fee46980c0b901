// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"
#include "rendered_frame.h"

#include <bundle_icp/volume/extract_surface.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

using namespace bundle_icp;
using namespace bundle_icp::test;

namespace {

constexpr double radius = 0.3, voxel = 0.005;

const Pose turn = Eigen::Translation3d(0.4, -0.2, 0.7) *
                  Pose(Eigen::AngleAxisd(0.9, Eigen::Vector3d(0.3, 0.5, -0.8).normalized()));

// A sphere around the world's origin of `world_from_sphere`, seen from all around.
TSDFVolume
fuseSphere(const std::optional<OrientedBox>& region, const Pose& world_from_sphere)
{
  TSDFOptions options;
  options.voxel_size = voxel;
  options.region = region;
  TSDFVolume volume(options);
  for (const Pose& pose : posesAllAround(1.0))
    volume.integrate(render(sphere(radius), pose), smallCamera(), world_from_sphere * pose);
  return volume;
}

SurfaceMesh
meshOf(const TSDFVolume& volume)
{
  MeshOptions options;
  options.cleaning.min_component_area = 0;
  return extractSurface(volume, options);
}

double
areaOf(const SurfaceMesh& mesh)
{
  double area = 0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[triangle[0]];
    area += (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a).norm() / 2;
  }
  return area;
}

// How far the mesh reaches along the axes of a box, at most.
Eigen::Vector3d
reachIn(const OrientedBox& box, const SurfaceMesh& mesh)
{
  Eigen::Vector3d reach = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    reach = reach.cwiseMax((box.world_from_box.inverse() * vertex.cast<double>()).cwiseAbs());
  return reach;
}

// Cuts the sphere open on all sides but z.
const Eigen::AlignedBox3d cut(Eigen::Vector3d(-0.2, -0.15, -0.5), Eigen::Vector3d(0.2, 0.15, 0.5));

} // namespace

TEST(Region, EndsTheSurfaceWithinAVoxelOfItsFaces)
{
  for (const Pose& pose : {Pose::Identity(), turn}) {
    OrientedBox box = cut;
    box.world_from_box = pose * box.world_from_box;
    const SurfaceMesh mesh = meshOf(fuseSphere(box, pose));
    ASSERT_GT(mesh.vertices.size(), 1000u);
    const Eigen::Vector3d reach = reachIn(box, mesh), half = 0.5 * box.size;
    for (int axis = 0; axis < 2; ++axis) {
      // Smoothing moves vertices by much less than a voxel.
      EXPECT_LE(reach[axis], half[axis] + 0.05 * voxel);
      // The corner of a cell that a turned box keeps is up to a diagonal away.
      EXPECT_GT(reach[axis], half[axis] - 1.8 * voxel);
    }
  }
}

TEST(Region, TurnsWithTheWorld)
{
  OrientedBox box = cut, turned = cut;
  turned.world_from_box = turn * box.world_from_box;
  const SurfaceMesh straight = meshOf(fuseSphere(box, Pose::Identity()));
  const SurfaceMesh rotated = meshOf(fuseSphere(turned, turn));
  // Two openings of 0.4 x 0.3 m and more, at whose edges up to the diagonal of a voxel is missing
  const double rim = 2 * 2 * (0.4 + 0.3);
  EXPECT_NEAR(areaOf(rotated), areaOf(straight), rim * 1.8 * voxel);
  for (const Eigen::Vector3f& vertex : rotated.vertices)
    ASSERT_NEAR((turn.inverse() * vertex.cast<double>()).norm(), radius, voxel / 2);
}

TEST(Region, ChangesNothingInside)
{
  OrientedBox box = cut;
  box.world_from_box = turn * box.world_from_box;
  const TSDFVolume all = fuseSphere(std::nullopt, turn), part = fuseSphere(box, turn);
  int inside = 0, outside = 0;
  for (const Eigen::Vector3f& vertex : meshOf(all).vertices) {
    const Eigen::Vector3d in_box = box.world_from_box.inverse() * vertex.cast<double>();
    const Eigen::Array3d room = 0.5 * box.size.array() - in_box.array().abs();
    if ((room > 2 * voxel).all()) {
      ASSERT_EQ(part.distance(vertex), all.distance(vertex));
      ++inside;
    }
    else if ((room < -2 * voxel).any()) {
      ASSERT_FALSE(part.distance(vertex).has_value());
      ++outside;
    }
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 500);
}

TEST(Region, LimitsAllocationToBlocksThatReachIntoIt)
{
  // Along a turned box's diagonal, most of its bounds is empty.
  OrientedBox box(turn, {0.7, 0.05, 0.05});
  const TSDFVolume part = fuseSphere(box, turn), all = fuseSphere(std::nullopt, turn);
  EXPECT_GT(part.numBlocks(), 0u);
  EXPECT_LT(part.numBlocks(), all.numBlocks() / 10);
  const TSDFVolume bounds = fuseSphere(OrientedBox(box.bounds()), turn);
  EXPECT_LT(part.numBlocks(), bounds.numBlocks() / 2);

  // Beside the sphere there is nothing to allocate.
  box.world_from_box = turn * Eigen::Translation3d(0, 0, 0.6);
  EXPECT_EQ(fuseSphere(box, turn).numBlocks(), 0u);
}

TEST(Region, KeepsToDepthsInRange)
{
  TSDFOptions options;
  options.min_depth = 0.8;
  options.max_depth = 1.2;
  TSDFVolume volume(options);
  // A floor that runs from near to far
  const Pose pose = lookAt({0, 0, 0.5}, {0, 1, 0});
  volume.integrate(render(plane({0, 0, 1}, 0), pose), smallCamera(), pose);
  const SurfaceMesh mesh = meshOf(volume);
  ASSERT_GT(mesh.vertices.size(), 1000u);
  double nearest = 9, farthest = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const double z = (pose.inverse() * vertex.cast<double>()).z();
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
  }
  EXPECT_NEAR(nearest, options.min_depth, 0.03);
  EXPECT_NEAR(farthest, options.max_depth, 0.03);
}

TEST(Region, IsRefusedWhenItIsNone)
{
  const auto refusal = [](const OrientedBox& box) {
    TSDFOptions options;
    options.region = box;
    return messageOf<pcl::BadArgumentException>([&] { TSDFVolume volume(options); });
  };
  OrientedBox box;
  box.size.y() = 0;
  EXPECT_CONTAINS(refusal(box), "region: must be finite, with min < max along each axis");
  box = {};
  box.size.x() = INFINITY;
  EXPECT_CONTAINS(refusal(box), "region: must be finite");
  box = {};
  box.world_from_box.linear() *= 2;
  EXPECT_CONTAINS(refusal(box), "region: world_from_box is not a rigid motion");
}
