// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/edge_collapse.h"

#include <bundle_icp/surface/mesh_decimation.h>

#include <pcl/exceptions.h>
#include <pcl/kdtree/kdtree_flann.h>

#include <cmath>

// Not pcl::MeshQuadricDecimationVTK: VTK stays out of the library, and it states no error.
namespace bundle_icp {
namespace {

/** The triangles around each vertex of a mesh, and its vertices by place. */
class NearbyTriangles {
public:
  explicit NearbyTriangles(SurfaceMesh mesh)
  : mesh_(std::move(mesh)), begin_(mesh_.vertices.size() + 1, 0),
    around_(3 * mesh_.triangles.size())
  {
    for (const Triangle& triangle : mesh_.triangles)
      for (const std::uint32_t vertex : triangle)
        ++begin_[vertex + 1];
    for (std::size_t v = 0; v + 1 < begin_.size(); ++v)
      begin_[v + 1] += begin_[v];
    std::vector<std::uint32_t> end(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < around_.size(); ++i)
      around_[end[mesh_.triangles[i / 3][i % 3]]++] = i / 3;
    const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    for (const Eigen::Vector3f& vertex : mesh_.vertices)
      cloud->push_back({vertex.x(), vertex.y(), vertex.z()});
    tree_.setInputCloud(cloud);
  }

  /** Distance to the triangles around the nearest vertex, squared. */
  double
  squaredDistanceTo(const Eigen::Vector3d& point) const
  {
    pcl::Indices nearest(1);
    std::vector<float> unused(1);
    const Eigen::Vector3f p = point.cast<float>();
    tree_.nearestKSearch(pcl::PointXYZ(p.x(), p.y(), p.z()), 1, nearest, unused);
    double least = INFINITY;
    for (std::uint32_t i = begin_[nearest[0]]; i < begin_[nearest[0] + 1]; ++i) {
      const Triangle& triangle = mesh_.triangles[around_[i]];
      least = std::min(least,
                       squaredDistance(point, corner(mesh_, triangle, 0), corner(mesh_, triangle, 1),
                                       corner(mesh_, triangle, 2)));
    }
    return least;
  }

private:
  SurfaceMesh mesh_;
  std::vector<std::uint32_t> begin_, around_;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree_;
};

/** Largest distance of corners, middles of edges and middle of each triangle. */
double
reverseError(const SurfaceMesh& mesh, const NearbyTriangles& original)
{
  double largest = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const Eigen::Vector3d a = corner(mesh, triangle, 0), b = corner(mesh, triangle, 1),
                          c = corner(mesh, triangle, 2);
    const Eigen::Vector3d samples[] = {a,           b,           c,           (a + b) / 2,
                                       (b + c) / 2, (c + a) / 2, (a + b + c) / 3};
    for (const Eigen::Vector3d& sample : samples)
      largest = std::max(largest, original.squaredDistanceTo(sample));
  }
  return std::sqrt(largest);
}

void
checkArguments(const SurfaceMesh& mesh, const MeshDecimationOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw pcl::BadArgumentException(error);
  checkLists(mesh, "decimateMesh");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite())
      throw pcl::BadArgumentException("decimateMesh: vertex " + std::to_string(i) +
                                      " is not finite");
}

} // namespace

bool
MeshDecimationOptions::isValid(std::string* error) const
{
  const bool is_valid = max_error >= 0 && std::isfinite(max_error);
  if (!is_valid && error)
    *error = "MeshDecimationOptions: max_error " + std::to_string(max_error) +
             "; expected 0 (no limit) or more metres";
  return is_valid;
}

MeshDecimationResult
decimateMesh(SurfaceMesh& mesh, const MeshDecimationOptions& options)
{
  checkArguments(mesh, options);
  MeshDecimationResult result;
  result.triangles_before = result.triangles_after = mesh.triangles.size();
  if (!options.isActive() || mesh.triangles.size() <= options.max_triangles)
    return result;
  removeUnusedVertices(mesh);
  SurfaceMesh original;
  original.vertices = mesh.vertices;
  original.triangles = mesh.triangles;

  {
    EdgeCollapse collapse(mesh);
    collapse.run(options);
    double sum = 0;
    for (const double squared : collapse.squaredErrors()) {
      sum += squared;
      result.max_error = std::max(result.max_error, std::sqrt(squared));
    }
    result.rms_error = std::sqrt(sum / double(original.vertices.size()));
    collapse.finish();
  }
  result.triangles_after = mesh.triangles.size();
  result.max_reverse_error = reverseError(mesh, NearbyTriangles(std::move(original)));
  return result;
}

MeshDecimationResult
decimateMesh(pcl::PolygonMesh& mesh, const MeshDecimationOptions& options)
{
  SurfaceMesh surface = toSurfaceMesh(mesh);
  const MeshDecimationResult result = decimateMesh(surface, options);
  const pcl::PCLHeader header = mesh.header;
  mesh = toPolygonMesh(surface);
  mesh.header = header;
  return result;
}

} // namespace bundle_icp
