// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mesh/edge_collapse.h"

#include "mesh/mesh_editing.h"
#include "mesh/triangle_distance.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/mesh/mesh_decimation.h>

#include <pcl/kdtree/kdtree_flann.h>

#include <cmath>

namespace bundle_icp {
namespace {

/** Largest distance of corners, middles of edges and middle of each triangle to the triangles
 *  around the nearest vertex of the original. */
double
reverseError(const SurfaceMesh& mesh, const SurfaceMesh& original)
{
  const HalfEdges edges(original.triangles, original.vertices.size());
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3f& vertex : original.vertices)
    cloud->push_back({vertex.x(), vertex.y(), vertex.z()});
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  pcl::Indices nearest(1);
  std::vector<float> unused(1);
  const auto squaredDistanceTo = [&](const Eigen::Vector3d& point) {
    const Eigen::Vector3f p = point.cast<float>();
    tree.nearestKSearch(pcl::PointXYZ(p.x(), p.y(), p.z()), 1, nearest, unused);
    double least = INFINITY;
    edges.forEachLeaving(nearest[0], [&](std::uint32_t h) {
      const Triangle& triangle = original.triangles[h / 3];
      least = std::min(least, squaredDistance(point, corner(original, triangle, 0),
                                              corner(original, triangle, 1),
                                              corner(original, triangle, 2)));
    });
    return least;
  };
  double largest = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const Eigen::Vector3d a = corner(mesh, triangle, 0), b = corner(mesh, triangle, 1),
                          c = corner(mesh, triangle, 2);
    for (const Eigen::Vector3d& sample : std::initializer_list<Eigen::Vector3d>{
             a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3})
      largest = std::max(largest, squaredDistanceTo(sample));
  }
  return std::sqrt(largest);
}

void
checkArguments(const SurfaceMesh& mesh, const MeshDecimationOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
  checkLists(mesh, "decimateMesh");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite())
      throw BadArgumentException("decimateMesh: vertex " + std::to_string(i) + " is not finite");
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

  double sum = 0;
  for (const double squared : collapseEdges(mesh, options)) {
    sum += squared;
    result.max_error = std::max(result.max_error, std::sqrt(squared));
  }
  result.rms_error = std::sqrt(sum / double(original.vertices.size()));
  result.triangles_after = mesh.triangles.size();
  result.max_reverse_error = reverseError(mesh, original);
  return result;
}

MeshDecimationResult
decimateMesh(pcl::PolygonMesh& mesh, const MeshDecimationOptions& options)
{
  return editSurface(mesh, [&](SurfaceMesh& surface) { return decimateMesh(surface, options); });
}

} // namespace bundle_icp
