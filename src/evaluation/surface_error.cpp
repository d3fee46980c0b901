// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include <bundle_icp/evaluation/surface_error.h>

#include <bundle_icp/common/exceptions.h>

#include <pcl/common/io.h>
#include <pcl/common/point_tests.h>
#include <pcl/conversions.h>
#include <pcl/kdtree/kdtree_flann.h>

#include <cmath>
#include <omp.h>

namespace bundle_icp {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

[[noreturn]] void
fail(const std::string& reason)
{
  throw BadArgumentException("surfaceError: " + reason);
}

Cloud
alignedVertices(const pcl::PolygonMesh& mesh, const Pose& truth_from_estimate)
{
  for (const char* const field : {"x", "y", "z"})
    if (pcl::getFieldIndex(mesh.cloud, field) < 0)
      fail("the mesh's vertices have no field " + std::string(field));
  Cloud vertices;
  pcl::fromPCLPointCloud2(mesh.cloud, vertices);
  for (pcl::PointXYZ& vertex : vertices)
    vertex.getVector3fMap() =
        (truth_from_estimate * vertex.getVector3fMap().cast<double>()).cast<float>();
  for (const pcl::Vertices& polygon : mesh.polygons)
    for (const auto index : polygon.vertices)
      if (std::size_t(index) >= vertices.size())
        fail("a polygon names vertex " + std::to_string(index) + " of " +
             std::to_string(vertices.size()));
  return vertices;
}

// Points spread uniformly by area: a point is due whenever another `spacing`^2 of area
// has been passed, triangle by triangle; where in the triangle, a low-discrepancy
// sequence says.
class AreaSampler {
public:
  static constexpr double MAX_SAMPLES = 1e8; // 1.6 GB
  explicit AreaSampler(double spacing) : area_per_sample_(spacing * spacing) {}

  void
  add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
  {
    const double area = (b - a).cross(c - a).norm() / 2;
    due_ += area / area_per_sample_;
    if (!(double(samples_->size()) + due_ <= MAX_SAMPLES))
      fail("the mesh has a vertex that is not finite, or more area than 1e8 samples cover");
    for (; due_ >= 1; due_ -= 1) {
      // The R2 sequence (Roberts 2018), folded into the triangle.
      u_ = std::fmod(u_ + 0.7548776662466927, 1.0);
      v_ = std::fmod(v_ + 0.5698402909980532, 1.0);
      const bool is_outside = u_ + v_ > 1;
      const double u = is_outside ? 1 - u_ : u_, v = is_outside ? 1 - v_ : v_;
      const Eigen::Vector3f point = (a + u * (b - a) + v * (c - a)).cast<float>();
      samples_->push_back(pcl::PointXYZ(point.x(), point.y(), point.z()));
    }
  }

  Cloud::ConstPtr
  samples() const
  {
    return samples_;
  }

private:
  double area_per_sample_;
  // Half a sample ahead, so that a mesh smaller than one sample's area may still get
  // one.
  double due_ = 0.5, u_ = 0.5, v_ = 0.5;
  Cloud::Ptr samples_ = std::make_shared<Cloud>();
};

Cloud::ConstPtr
sampleMesh(const pcl::PolygonMesh& mesh, const SurfaceErrorOptions& options)
{
  const Cloud vertices = alignedVertices(mesh, options.truth_from_estimate);
  const auto at = [&](pcl::index_t index) -> Eigen::Vector3d {
    return vertices[index].getVector3fMap().cast<double>();
  };
  AreaSampler sampler(options.sample_spacing);
  for (const pcl::Vertices& polygon : mesh.polygons)
    for (std::size_t k = 2; k < polygon.vertices.size(); ++k)
      sampler.add(at(polygon.vertices[0]), at(polygon.vertices[k - 1]), at(polygon.vertices[k]));
  if (sampler.samples()->empty())
    fail("the mesh has no area: " + std::to_string(mesh.polygons.size()) + " polygons");
  return sampler.samples();
}

// Distance of each of `points` to the nearest of `others`.
std::vector<double>
nearestDistances(const Cloud& points, const Cloud::ConstPtr& others, int num_threads)
{
  pcl::KdTreeFLANN<pcl::PointXYZ> tree(false);
  tree.setInputCloud(others);
  std::vector<double> distances(points.size());
#pragma omp parallel num_threads(num_threads)
  {
    pcl::Indices index(1);
    std::vector<float> squared(1);
#pragma omp for schedule(dynamic, 1024)
    for (std::ptrdiff_t i = 0; i < std::ptrdiff_t(points.size()); ++i) {
      tree.nearestKSearch(points[i], 1, index, squared);
      distances[i] = std::sqrt(squared[0]);
    }
  }
  return distances;
}

std::vector<double>
knownDistances(const Cloud& points, const SurfaceErrorOptions& options, int num_threads)
{
  std::vector<double> distances(points.size());
#pragma omp parallel for num_threads(num_threads) schedule(dynamic, 1024)
  for (std::ptrdiff_t i = 0; i < std::ptrdiff_t(points.size()); ++i)
    distances[i] = options.distance_to_truth(points[i].getVector3fMap().cast<double>());
  return distances;
}

} // namespace

bool
SurfaceErrorOptions::isValid(std::string* error) const
{
  const auto failed = [error](const std::string& reason) {
    if (error)
      *error = reason;
    return false;
  };
  if (!isRigid(truth_from_estimate.matrix()))
    return failed("truth_from_estimate is not a rigid motion");
  if (!(std::isfinite(completeness_distance) && completeness_distance > 0))
    return failed("completeness_distance must be finite and positive");
  if (!(sample_spacing > 0 && sample_spacing <= completeness_distance / 2))
    return failed("sample_spacing must be positive and at most half of "
                  "completeness_distance");
  if (num_threads < 0)
    return failed("num_threads must be 0 (all) or more");
  return true;
}

SurfaceError
surfaceError(const pcl::PolygonMesh& mesh, const Cloud& surface, const SurfaceErrorOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    fail(error);
  const auto truth = std::make_shared<Cloud>();
  for (const pcl::PointXYZ& point : surface)
    if (pcl::isFinite(point))
      truth->push_back(point);
  if (truth->empty())
    fail("the true surface has no finite point");

  const int num_threads = options.num_threads > 0 ? options.num_threads : omp_get_max_threads();
  const Cloud::ConstPtr samples = sampleMesh(mesh, options);
  SurfaceError result;
  result.accuracy =
      errorStatistics(options.distance_to_truth ? knownDistances(*samples, options, num_threads)
                                                : nearestDistances(*samples, truth, num_threads));
  std::size_t num_complete = 0;
  for (const double distance : nearestDistances(*truth, samples, num_threads))
    num_complete += distance <= options.completeness_distance;
  result.completeness = double(num_complete) / double(truth->size());
  return result;
}

SurfaceError
surfaceError(const pcl::PolygonMesh& mesh, const pcl::PointCloud<pcl::PointNormal>& surface,
             const SurfaceErrorOptions& options)
{
  Cloud points;
  pcl::PointCloud<pcl::PointNormal>::Ptr truth(new pcl::PointCloud<pcl::PointNormal>);
  for (const pcl::PointNormal& point : surface)
    if (pcl::isFinite(point)) {
      truth->push_back(point);
      points.emplace_back(point.x, point.y, point.z);
    }
  SurfaceErrorOptions planes = options;
  pcl::KdTreeFLANN<pcl::PointNormal> tree(false);
  if (!truth->empty() && !options.distance_to_truth) {
    tree.setInputCloud(truth);
    planes.distance_to_truth = [&](const Eigen::Vector3d& p) {
      pcl::PointNormal query;
      query.getVector3fMap() = p.cast<float>();
      pcl::Indices index(1);
      std::vector<float> squared(1);
      tree.nearestKSearch(query, 1, index, squared);
      const pcl::PointNormal& nearest = (*truth)[index[0]];
      const float along = std::abs(
          nearest.getNormalVector3fMap().dot(query.getVector3fMap() - nearest.getVector3fMap()));
      // Aside by more than the true points are apart there is no true surface.
      const double aside = std::sqrt(std::max(0.0f, squared[0] - along * along));
      return aside < options.completeness_distance ? double(along) : std::sqrt(double(squared[0]));
    };
  }
  return surfaceError(mesh, points, planes);
}

} // namespace bundle_icp
