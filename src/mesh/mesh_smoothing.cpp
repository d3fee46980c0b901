// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/parallel.h"

#include "mesh/mesh_editing.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/mesh/mesh_smoothing.h>

#include <cmath>

namespace bundle_icp {
namespace {

/** Neighbours whose normals differ by more than 60 degrees are beyond an edge (cosine). */
constexpr float SAME_SIDE = 0.5F;
/** Standard deviations of the difference beyond which a neighbour lies beyond a step. */
constexpr float SURFACE_SIGMAS = 3;

/** Data that smoothing reads of a vertex, side by side: neighbours are all over the mesh. */
struct Vertex {
  Eigen::Vector3f position;
  float precision; ///< 1 / variance [1/m^2]
  Eigen::Vector3f normal;
  float offset; ///< along the normal, to where the neighbours and the vertex say together
};

/** The neighbours of a vertex are those to which a half-edge of its triangles leads: each of an
 *  interior one is there once. */
class Smoother {
public:
  Smoother(const SurfaceMesh& mesh, int num_threads)
  : num_threads_(num_threads), vertices_(mesh.vertices.size()),
    edges_(mesh.triangles, mesh.vertices.size())
  {
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      vertices_[v] = {mesh.vertices[v], 1 / (mesh.deviations[v] * mesh.deviations[v]),
                      mesh.normals[v], 0};
  }

  void
  smoothNormals(int iterations)
  {
    std::vector<Eigen::Vector3f> means(vertices_.size());
    for (int i = 0; i < iterations; ++i) {
#pragma omp parallel num_threads(num_threads_)
      {
#pragma omp for
        for (std::size_t v = 0; v < means.size(); ++v)
          means[v] = meanNormal(v);
#pragma omp for
        for (std::size_t v = 0; v < means.size(); ++v)
          vertices_[v].normal = means[v];
      }
    }
  }

  void
  smoothPositions(int iterations)
  {
    for (int i = 0; i < iterations; ++i) {
#pragma omp parallel num_threads(num_threads_)
      {
#pragma omp for
        for (std::size_t v = 0; v < vertices_.size(); ++v)
          vertices_[v].offset = offset(v);
#pragma omp for
        for (std::size_t v = 0; v < vertices_.size(); ++v)
          if (vertices_[v].offset != 0) // it is where the normal is unknown
            vertices_[v].position += vertices_[v].offset * vertices_[v].normal;
      }
    }
  }

  void
  write(SurfaceMesh& mesh) const
  {
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      mesh.vertices[v] = vertices_[v].position;
      mesh.normals[v] = vertices_[v].normal;
    }
  }

private:
  Eigen::Vector3f
  meanNormal(std::size_t v) const
  {
    const Eigen::Vector3f& normal = vertices_[v].normal;
    Eigen::Vector3f sum = normal;
    edges_.forEachLeaving(v, [&](std::uint32_t h) {
      const Eigen::Vector3f& other = vertices_[edges_.to(h)].normal;
      const float cosine = other.dot(normal);
      if (cosine > SAME_SIDE)
        sum += (cosine - SAME_SIDE) / (1 - SAME_SIDE) * other;
    });
    return sum.normalized();
  }

  float
  offset(std::size_t v) const
  {
    const Vertex& vertex = vertices_[v];
    float sum = 0, weights = vertex.precision;
    edges_.forEachLeaving(v, [&](std::uint32_t h) {
      const Vertex& other = vertices_[edges_.to(h)];
      const float along =
          0.5F * (vertex.normal + other.normal).dot(other.position - vertex.position);
      // The square of the difference over its variance.
      const float sigmas =
          along * along * vertex.precision * other.precision / (vertex.precision + other.precision);
      const float falloff = 1 - sigmas * (1 / (SURFACE_SIGMAS * SURFACE_SIGMAS));
      if (!(falloff > 0)) // nor NaN
        return;
      const float weight = falloff * falloff * other.precision;
      sum += weight * along;
      weights += weight;
    });
    return weights > 0 ? sum / weights : 0; // NaN: 0
  }

  const int num_threads_;
  std::vector<Vertex> vertices_;
  const HalfEdges edges_;
};

/** What is left of standard deviations, measured on planes with noise of which half is shared by
 *  neighbouring pixels: 0.4 to 0.8 after five iterations, the less where an edge of the mesh is
 *  some pixels long, and hardly less after more. */
float
remainingDeviation(int iterations)
{
  constexpr float shared = 0.57F;
  return shared + (1 - shared) * std::exp(-0.5F * float(iterations));
}

} // namespace

bool
MeshSmoothingOptions::isValid(std::string* error) const
{
  std::string reason;
  if (iterations < 0 || iterations > 1000)
    reason = "iterations " + std::to_string(iterations) + "; expected 0 (none) to 1000";
  else if (num_threads < 0)
    reason = "num_threads " + std::to_string(num_threads) + "; expected 0 (all) or more";
  if (error && !reason.empty())
    *error = "MeshSmoothingOptions: " + reason;
  return reason.empty();
}

void
smoothMesh(SurfaceMesh& mesh, const MeshSmoothingOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
  checkLists(mesh, "smoothMesh");
  if (options.iterations == 0 || mesh.normals.empty() || mesh.deviations.empty())
    return;
  constexpr int normal_iterations = 2;
  Smoother smoother(mesh, resolveThreads(options.num_threads));
  smoother.smoothNormals(normal_iterations);
  smoother.smoothPositions(options.iterations);
  smoother.write(mesh);
  const float remaining = remainingDeviation(options.iterations);
  for (float& deviation : mesh.deviations)
    deviation *= remaining;
}

} // namespace bundle_icp
