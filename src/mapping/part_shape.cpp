// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "mapping/part_shape.h"

#include "refinement/spread.h"

#include <Eigen/Eigenvalues>
#include <opencv2/core.hpp>
#include <pcl/common/transforms.h>
#include <pcl/features/fpfh.h>
#include <pcl/features/impl/fpfh.hpp>
#include <pcl/filters/voxel_grid.h>
#include <pcl/search/impl/kdtree.hpp>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;

/** Spacing of the cloud as a share of the median depth; radius of a descriptor in spacings. */
constexpr double SPACING = 0.04, RADIUS = 5;
/** Pixels along the width of an image that the cloud is made of. */
constexpr int PIXELS_ALONG_WIDTH = 80;
/** The surface bends where so many of the neighbours' normals deviate by more than 25 degrees. */
constexpr double BENT_SHARE = 0.2, BENT_COSINE = 0.9;
constexpr std::size_t MAX_KEYPOINTS = 1000;
/** A plane holds so much of the cloud at least. */
constexpr double LEAST_PLANE = 0.015;
constexpr std::size_t MAX_PLANES = 10;
/** Seeds that planes are looked for from. */
constexpr std::size_t PLANE_SEEDS = 400;

bool
isOriented(const pcl::PointNormal& point)
{
  return std::isfinite(point.x) && std::isfinite(point.normal_x);
}

double
medianDepth(const SparseModel& model, const DepthViewProvider& depth_views, const Part& part)
{
  std::vector<double> depths;
  for (const std::size_t frame : part) {
    const auto view = depth_views(frame, model);
    const int step = std::max(1, view->camera.width / 20);
    for (int row = step / 2; row < view->camera.height; row += step)
      for (int column = step / 2; column < view->camera.width; column += step)
        if (const float z = view->depth.at<float>(row, column); z > 0)
          depths.push_back(z);
  }
  return medianOf(depths);
}

Cloud::Ptr
allPoints(const SparseModel& model, const DepthViewProvider& depth_views, const Part& part)
{
  Cloud::Ptr all(new Cloud);
  for (const std::size_t frame : part) {
    const auto view = depth_views(frame, model);
    const int step = std::max(1, view->camera.width / PIXELS_ALONG_WIDTH);
    const Pose& pose = model.worldFromDepth(frame);
    for (int row = step / 2; row < view->camera.height; row += step)
      for (int column = step / 2; column < view->camera.width; column += step) {
        const float z = view->depth.at<float>(row, column);
        const cv::Vec3f& n = view->normals.at<cv::Vec3f>(row, column);
        if (!DepthComparison::isPlain(*view, row, column) || !std::isfinite(n[0]))
          continue;
        pcl::PointNormal point;
        point.getVector3fMap() = (pose * view->camera.unproject(column, row, z)).cast<float>();
        point.getNormalVector3fMap() =
            (pose.linear() * Eigen::Vector3d(n[0], n[1], n[2])).cast<float>();
        all->push_back(point);
      }
  }
  return all;
}

/** The points where the surface bends; of many, every so many. */
pcl::Indices
bentPoints(const Cloud& cloud, const pcl::search::KdTree<pcl::PointNormal>& tree, double radius)
{
  pcl::Indices bent, found;
  std::vector<float> squared_distances;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const int count = tree.radiusSearch(cloud[i], radius, found, squared_distances);
    const auto deviating = std::count_if(found.begin(), found.end(), [&](int j) {
      return cloud[i].getNormalVector3fMap().dot(cloud[std::size_t(j)].getNormalVector3fMap()) <
             BENT_COSINE;
    });
    if (double(deviating) > BENT_SHARE * count)
      bent.push_back(int(i));
  }
  const std::size_t step = (bent.size() + MAX_KEYPOINTS - 1) / MAX_KEYPOINTS;
  pcl::Indices some;
  for (std::size_t k = 0; k < bent.size(); k += step)
    some.push_back(bent[k]);
  return some;
}

std::vector<PartShape::Keypoint>
findKeypoints(const Cloud::Ptr& cloud, double radius)
{
  pcl::search::KdTree<pcl::PointNormal>::Ptr tree(new pcl::search::KdTree<pcl::PointNormal>);
  tree->setInputCloud(cloud);
  const pcl::IndicesPtr bent(new pcl::Indices(bentPoints(*cloud, *tree, radius)));
  if (bent->empty())
    return {};
  pcl::FPFHEstimation<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> estimation;
  estimation.setInputCloud(cloud);
  estimation.setInputNormals(cloud);
  estimation.setIndices(bent);
  estimation.setSearchMethod(tree);
  estimation.setRadiusSearch(radius);
  pcl::PointCloud<pcl::FPFHSignature33> signatures;
  estimation.compute(signatures);
  std::vector<PartShape::Keypoint> keypoints;
  for (std::size_t k = 0; k < bent->size(); ++k) {
    PartShape::Keypoint keypoint;
    const pcl::PointNormal& point = (*cloud)[std::size_t((*bent)[k])];
    keypoint.point = point.getVector3fMap();
    keypoint.normal = point.getNormalVector3fMap();
    std::copy_n(signatures[k].histogram, keypoint.descriptor.size(), keypoint.descriptor.begin());
    Eigen::Map<Eigen::Matrix<float, 33, 1>> descriptor(keypoint.descriptor.data());
    if (!descriptor.allFinite() || !(descriptor.norm() > 0))
      continue;
    descriptor.normalize();
    keypoints.push_back(keypoint);
  }
  return keypoints;
}

/** The points of a cloud, of those that are free, that lie on a plane. */
std::vector<std::size_t>
pointsOn(const Cloud& cloud, const std::vector<char>& taken, const Eigen::Vector3f& normal,
         float offset, float tolerance)
{
  constexpr float max_turn = 0.95F; // 18 degrees
  std::vector<std::size_t> on;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (!taken[i] && cloud[i].getNormalVector3fMap().dot(normal) > max_turn &&
        std::abs(cloud[i].getVector3fMap().dot(normal) - offset) < tolerance)
      on.push_back(i);
  return on;
}

/** The plane closest to points that lie about it. */
PartShape::Plane
fitPlane(const Cloud& cloud, const std::vector<std::size_t>& points, const Eigen::Vector3f& side)
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::size_t i : points)
    mean += cloud[i].getVector3fMap().cast<double>();
  mean /= double(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t i : points) {
    const Eigen::Vector3d d = cloud[i].getVector3fMap().cast<double>() - mean;
    scatter += d * d.transpose();
  }
  Eigen::Vector3d normal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  if (normal.dot(side.cast<double>()) < 0)
    normal = -normal;
  return {normal, normal.dot(mean), points.size()};
}

/** The largest planes, one after the other. */
std::vector<PartShape::Plane>
findPlanes(const Cloud& cloud, double spacing)
{
  std::vector<PartShape::Plane> planes;
  std::vector<char> taken(cloud.size(), 0);
  const auto tolerance = float(spacing);
  const std::size_t step = std::max<std::size_t>(1, cloud.size() / PLANE_SEEDS);
  while (planes.size() < MAX_PLANES) {
    std::vector<std::size_t> largest;
    Eigen::Vector3f side = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < cloud.size(); i += step) {
      if (taken[i])
        continue;
      const Eigen::Vector3f normal = cloud[i].getNormalVector3fMap();
      auto on = pointsOn(cloud, taken, normal, cloud[i].getVector3fMap().dot(normal), tolerance);
      if (on.size() > largest.size()) {
        largest = std::move(on);
        side = normal;
      }
    }
    if (double(largest.size()) < LEAST_PLANE * double(cloud.size()) || largest.size() < 10)
      return planes;
    const PartShape::Plane plane = fitPlane(cloud, largest, side);
    for (const std::size_t i :
         pointsOn(cloud, taken, plane.normal.cast<float>(), float(plane.offset), 1.5F * tolerance))
      taken[i] = 1;
    for (const std::size_t i : largest)
      taken[i] = 1;
    planes.push_back(plane);
  }
  return planes;
}

} // namespace

PartShape
partShape(const SparseModel& model, const DepthViewProvider& depth_views, const Part& part)
{
  PartShape shape;
  shape.spacing = SPACING * medianDepth(model, depth_views, part);
  const Cloud::Ptr all = allPoints(model, depth_views, part);
  if (all->empty() || !(shape.spacing > 0))
    return shape;
  pcl::VoxelGrid<pcl::PointNormal> grid;
  grid.setInputCloud(all);
  const auto leaf = float(shape.spacing);
  grid.setLeafSize(leaf, leaf, leaf);
  const Cloud::Ptr sparse(new Cloud);
  grid.filter(*sparse);
  for (const pcl::PointNormal& point : *sparse)
    if (isOriented(point))
      shape.cloud.push_back(point);
  if (shape.cloud.empty())
    return shape;
  shape.keypoints = findKeypoints(shape.cloud.makeShared(), RADIUS * shape.spacing);
  shape.planes = findPlanes(shape.cloud, shape.spacing);
  return shape;
}

} // namespace bundle_icp
