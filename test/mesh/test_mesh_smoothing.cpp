// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "messages.h"

#include <bundle_icp/mesh/mesh_smoothing.h>

#include <gtest/gtest.h>
#include <pcl/exceptions.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

using namespace bundle_icp;

namespace {

constexpr int size = 60;          // vertices along each side
constexpr float spacing = 0.005F; // of vertices [m]
constexpr float sigma = 0.001F;   // of their noise [m]

using Height = std::function<float(float x, float y)>;

// A grid whose vertices are off the surface z(x, y) by noise along its normals.
SurfaceMesh
noisyGrid(const Height& height, float noise_sigma = sigma)
{
  SurfaceMesh mesh;
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, noise_sigma);
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i) {
      const float x = spacing * (i - size / 2), y = spacing * (j - size / 2), step = 1e-3F;
      const Eigen::Vector3f normal =
          Eigen::Vector3f(height(x - step, y) - height(x + step, y),
                          height(x, y - step) - height(x, y + step), 2 * step)
              .normalized();
      mesh.vertices.push_back(Eigen::Vector3f(x, y, height(x, y)) + noise(random) * normal);
      mesh.normals.push_back(normal);
      mesh.deviations.push_back(sigma);
    }
  for (int j = 0; j + 1 < size; ++j)
    for (int i = 0; i + 1 < size; ++i) {
      const std::uint32_t a = j * size + i, b = a + 1, c = a + size, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  return mesh;
}

// RMS and mean distance to the surface along z, away from the border.
std::pair<double, double>
errors(const SurfaceMesh& mesh, const Height& height)
{
  double sum = 0, squares = 0;
  int count = 0;
  for (int j = 10; j < size - 10; ++j)
    for (int i = 10; i < size - 10; ++i) {
      const Eigen::Vector3f& p = mesh.vertices[j * size + i];
      const double error = p.z() - height(p.x(), p.y());
      sum += error;
      squares += error * error;
      ++count;
    }
  return {std::sqrt(squares / count), sum / count};
}

float
flat(float, float)
{
  return 0;
}

float
ball(float x, float y) // of 20 cm
{
  return std::sqrt(0.04F - 0.5F * x * x - 0.5F * y * y);
}

} // namespace

TEST(SmoothMesh, TakesNoiseOffAPlane)
{
  SurfaceMesh mesh = noisyGrid(flat);
  smoothMesh(mesh);
  EXPECT_LT(errors(mesh, flat).first, 0.5 * sigma);
  // What it says of its own accuracy is on the safe side: independent noise averages out best.
  EXPECT_LT(errors(mesh, flat).first, mesh.deviations.front());
  EXPECT_LT(mesh.deviations.front(), sigma);
}

TEST(SmoothMesh, DoesNotShrinkRoundThings)
{
  // By its curvature alone, plain averaging would move this surface by 0.25 mm in 20 iterations.
  SurfaceMesh mesh = noisyGrid(ball, 0);
  MeshSmoothingOptions options;
  options.iterations = 20;
  smoothMesh(mesh, options);
  EXPECT_LT(std::abs(errors(mesh, ball).second), 0.02 * sigma);
}

TEST(SmoothMesh, KeepsStepsThatAreNoNoise)
{
  const Height step = [](float x, float) { return x < -0.001F ? 0.0F : 8 * sigma; };
  SurfaceMesh mesh = noisyGrid(step, 0);
  mesh.normals.assign(mesh.normals.size(), Eigen::Vector3f::UnitZ());
  const SurfaceMesh before = mesh;
  smoothMesh(mesh);
  EXPECT_EQ(mesh.vertices, before.vertices);
}

TEST(SmoothMesh, IsTheSameForAnyNumberOfThreads)
{
  SurfaceMesh one = noisyGrid(ball), three = one;
  MeshSmoothingOptions options;
  options.num_threads = 1;
  smoothMesh(one, options);
  options.num_threads = 3;
  smoothMesh(three, options);
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.normals, three.normals);
}

TEST(SmoothMesh, LeavesWhatDoesNotSayHowNoisyItIs)
{
  SurfaceMesh mesh = noisyGrid(flat);
  const SurfaceMesh before = mesh;
  MeshSmoothingOptions options;
  options.iterations = 0;
  smoothMesh(mesh, options);
  EXPECT_EQ(mesh.vertices, before.vertices);
  mesh.deviations.clear();
  smoothMesh(mesh);
  EXPECT_EQ(mesh.vertices, before.vertices);
  SurfaceMesh unknown = before;
  unknown.deviations.assign(unknown.deviations.size(), std::numeric_limits<float>::quiet_NaN());
  smoothMesh(unknown);
  EXPECT_EQ(unknown.vertices, before.vertices);
}

TEST(SmoothMesh, VerticesWithoutNormalStay)
{
  SurfaceMesh mesh = noisyGrid(flat);
  constexpr std::size_t middle = size * size / 2;
  mesh.normals[middle].setConstant(std::numeric_limits<float>::quiet_NaN());
  const Eigen::Vector3f before = mesh.vertices[middle];
  smoothMesh(mesh);
  EXPECT_EQ(mesh.vertices[middle], before);
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    EXPECT_TRUE(vertex.allFinite());
}

TEST(SmoothMesh, RefusesBadInput)
{
  SurfaceMesh mesh = noisyGrid(flat);
  MeshSmoothingOptions options;
  const auto refusal = [&] {
    return messageOf<pcl::BadArgumentException>([&] { smoothMesh(mesh, options); });
  };
  options.iterations = -1;
  EXPECT_CONTAINS(refusal(), "iterations -1");
  options.iterations = 1001;
  EXPECT_CONTAINS(refusal(), "iterations 1001");
  options = {};
  options.num_threads = -1;
  EXPECT_CONTAINS(refusal(), "num_threads -1");
  options = {};
  mesh.normals.pop_back();
  EXPECT_CONTAINS(refusal(), "normals");
}
