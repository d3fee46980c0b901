// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "common/concatenate.h"

#include "common/depth_edges.h"
#include "volume/cell_grid.h"

#include <bundle_icp/common/exceptions.h>
#include <bundle_icp/volume/object_region.h>

#include <opencv2/imgproc.hpp>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/extract_polygonal_prism_data.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

using Cloud = CellGrid::Cloud;

/** The plane with most of the points; empty without one. */
pcl::ModelCoefficients
segmentPlane(const Cloud::ConstPtr& points, const ObjectRegionOptions& options, double& share)
{
  pcl::SACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setDistanceThreshold(options.plane_tolerance);
  segmentation.setMaxIterations(1000);
  segmentation.setOptimizeCoefficients(true);
  segmentation.setInputCloud(points);
  pcl::PointIndices inliers;
  pcl::ModelCoefficients plane;
  segmentation.segment(inliers, plane);
  share = points->empty() ? 0 : double(inliers.indices.size()) / double(points->size());
  return plane;
}

/** n . x + d = 0 with most cameras on the side to which n points. */
Eigen::Vector4d
towardsCameras(const pcl::ModelCoefficients& coefficients,
               const std::vector<Pose>& world_from_cameras)
{
  const Eigen::Vector4d plane = Eigen::Vector4f(coefficients.values.data()).cast<double>();
  const auto in_front = std::count_if(
      world_from_cameras.begin(), world_from_cameras.end(), [&plane](const Pose& pose) {
        return plane.head<3>().dot(pose.translation()) + plane[3] > 0;
      });
  const bool is_front = 2 * std::size_t(in_front) >= world_from_cameras.size();
  return (is_front ? plane : -plane) / plane.head<3>().norm();
}

std::vector<pcl::PointIndices>
clusters(const Cloud::ConstPtr& cloud, const pcl::IndicesConstPtr& indices, double tolerance,
         std::size_t min_size)
{
  std::vector<pcl::PointIndices> found;
  if (indices->size() < min_size)
    return found;
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  const pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  tree->setInputCloud(cloud, indices);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(cloud);
  extraction.setIndices(indices);
  extraction.setClusterTolerance(tolerance);
  extraction.setMinClusterSize(pcl::uindex_t(min_size));
  extraction.extract(found);
  return found;
}

/** A frame with its x and y axes in a plane. */
Pose
planeFrame(const Eigen::Vector4d& plane)
{
  const Eigen::Vector3d normal = plane.head<3>();
  Pose world_from_plane = Pose::Identity();
  world_from_plane.linear().col(2) = normal;
  world_from_plane.linear().col(0) = normal.unitOrthogonal();
  world_from_plane.linear().col(1) = normal.cross(world_from_plane.linear().col(0));
  world_from_plane.translation() = -plane[3] * normal;
  return world_from_plane;
}

/** Their convex hull in a plane. */
Cloud::Ptr
outlineOf(const Cloud& cells, const pcl::Indices& indices, const Eigen::Vector4d& plane)
{
  const Pose world_from_plane = planeFrame(plane), plane_from_world = world_from_plane.inverse();
  std::vector<cv::Point2f> footprint, hull;
  for (const auto i : indices) {
    const Eigen::Vector3d point = plane_from_world * cells[i].getVector3fMap().cast<double>();
    footprint.emplace_back(float(point.x()), float(point.y()));
  }
  cv::convexHull(footprint, hull);
  const Cloud::Ptr outline(new Cloud);
  for (const cv::Point2f& corner : hull) {
    const Eigen::Vector3d point = world_from_plane * Eigen::Vector3d(corner.x, corner.y, 0);
    outline->push_back({float(point.x()), float(point.y()), float(point.z())});
  }
  return outline;
}

/** Cells above the plane and within the outline of its largest connected part. */
pcl::IndicesPtr
cellsOnPlane(const CellGrid& grid, const Eigen::Vector4d& plane, const ObjectRegionOptions& options)
{
  const Cloud::ConstPtr cells = grid.centers;
  // What goes on above or below is an upright surface that crosses the plane.
  const Eigen::Vector3d off = (options.plane_tolerance + 2 * options.cell_size) * plane.head<3>();
  const pcl::IndicesPtr in_plane(new pcl::Indices), above(new pcl::Indices);
  for (std::size_t i = 0; i < cells->size(); ++i) {
    const Eigen::Vector3d point = (*cells)[i].getVector3fMap().cast<double>();
    if (std::abs(plane.head<3>().dot(point) + plane[3]) <= options.plane_tolerance &&
        grid.at(point + off) < 0 && grid.at(point - off) < 0)
      in_plane->push_back(int(i));
  }
  // What stands on the plane hides strips of it: small gaps do not part it.
  const auto parts = clusters(cells, in_plane, 2.5 * options.cluster_tolerance, 3);
  if (parts.empty())
    return above;
  const Cloud::Ptr outline = outlineOf(*cells, parts.front().indices, plane);
  if (outline->size() < 3)
    return above;
  pcl::ExtractPolygonalPrismData<pcl::PointXYZ> prism;
  prism.setInputCloud(cells);
  prism.setInputPlanarHull(outline);
  // Heights count towards the viewpoint.
  const Eigen::Vector3f viewpoint =
      (outline->front().getVector3fMap().cast<double>() + 1000 * plane.head<3>()).cast<float>();
  prism.setViewPoint(viewpoint.x(), viewpoint.y(), viewpoint.z());
  prism.setHeightLimits(options.min_height, options.max_height);
  pcl::PointIndices inside;
  prism.segment(inside);
  *above = inside.indices;
  return above;
}

/** Number of frames that look at each cluster more than at any other. */
std::vector<std::size_t>
countLooks(const std::vector<pcl::PointIndices>& objects, const CellGrid& grid,
           const std::vector<Cloud>& clouds, const std::vector<Pose>& world_from_cameras,
           double view_angle)
{
  std::vector<int> object_of_cell(grid.centers->size(), -1);
  for (std::size_t i = 0; i < objects.size(); ++i)
    for (const auto cell : objects[i].indices)
      object_of_cell[cell] = int(i);
  std::vector<std::size_t> looks(objects.size(), 0);
  for (std::size_t frame = 0; frame < clouds.size(); ++frame) {
    std::vector<std::size_t> points(objects.size(), 0);
    for (const pcl::PointXYZ& point : clouds[frame]) {
      if (!(std::hypot(point.x, point.y) <= std::tan(view_angle) * point.z))
        continue;
      const int cell = grid.at(world_from_cameras[frame] * point.getVector3fMap().cast<double>());
      if (cell >= 0 && object_of_cell[cell] >= 0)
        ++points[object_of_cell[cell]];
    }
    const auto most = std::max_element(points.begin(), points.end());
    if (*most > 0)
      ++looks[most - points.begin()];
  }
  return looks;
}

/** The smallest box around points that stands on a plane. */
OrientedBox
boxOnPlane(const Cloud& cells, const pcl::Indices& indices, const Eigen::Vector4d& plane,
           double margin)
{
  const Pose world_from_plane = planeFrame(plane), plane_from_world = world_from_plane.inverse();
  std::vector<cv::Point2f> footprint;
  double height = 0;
  for (const auto i : indices) {
    const Eigen::Vector3d point = plane_from_world * cells[i].getVector3fMap().cast<double>();
    footprint.emplace_back(float(point.x()), float(point.y()));
    height = std::max(height, point.z());
  }
  const cv::RotatedRect rectangle = cv::minAreaRect(footprint);
  const double top = height + margin, bottom = -margin;
  OrientedBox box;
  box.world_from_box =
      world_from_plane *
      Eigen::Translation3d(rectangle.center.x, rectangle.center.y, (top + bottom) / 2) *
      Eigen::AngleAxisd(rectangle.angle * CV_PI / 180, Eigen::Vector3d::UnitZ());
  box.size = {rectangle.size.width + 2 * margin, rectangle.size.height + 2 * margin, top - bottom};
  return box;
}

void
checkArguments(const std::vector<Cloud>& clouds, const std::vector<Pose>& world_from_cameras,
               const ObjectRegionOptions& options)
{
  std::string error;
  if (!options.isValid(&error))
    throw BadArgumentException(error);
  if (clouds.empty() || clouds.size() != world_from_cameras.size())
    throw BadArgumentException(concatenate("findObjectRegion: ", clouds.size(), " clouds and ",
                                           world_from_cameras.size(),
                                           " poses; expected as many of "
                                           "both, at least one"));
  for (std::size_t i = 0; i < world_from_cameras.size(); ++i)
    if (!isRigid(world_from_cameras[i].matrix()))
      throw BadArgumentException(
          concatenate("findObjectRegion: pose ", i, " is not a rigid motion"));
}

} // namespace

bool
ObjectRegionOptions::isValid(std::string* error) const
{
  std::string reason;
  const auto check = [&reason](const char* name, double value, double low, double high) {
    if (reason.empty() && !(value >= low && value <= high))
      reason = concatenate(name, " ", value, "; expected ", low, " to ", high);
  };
  check("cell_size", cell_size, 0.001, 0.1);
  check("max_depth", max_depth, 0.2, 100);
  check("plane_tolerance", plane_tolerance, 0.001, 0.2);
  check("min_plane_share", min_plane_share, 0, 1);
  check("min_height", min_height, plane_tolerance, max_height);
  check("max_height", max_height, min_height, 100);
  check("cluster_tolerance", cluster_tolerance, cell_size, 20 * cell_size);
  check("min_cells", double(min_cells), 1, 1e9);
  check("view_angle", view_angle, 0.01, 1);
  check("margin", margin, 0, 1);
  if (error && !reason.empty())
    *error = "ObjectRegionOptions: " + reason;
  return reason.empty();
}

ObjectRegion
findObjectRegion(const std::vector<Cloud>& clouds, const std::vector<Pose>& world_from_cameras,
                 const ObjectRegionOptions& options)
{
  checkArguments(clouds, world_from_cameras, options);
  ObjectRegion region;
  region.num_frames = clouds.size();
  const CellGrid grid(clouds, world_from_cameras, options);
  double share = 0;
  const Cloud::Ptr points = grid.weightedPoints(20000);
  constexpr std::size_t least_points = 100;
  pcl::ModelCoefficients coefficients;
  if (points->size() >= least_points)
    coefficients = segmentPlane(points, options, share);
  if (coefficients.values.size() != 4 || share < options.min_plane_share) {
    region.reason =
        concatenate("no plane: the largest holds ", 100 * share, " % of ", points->size(),
                    " points within ", options.max_depth, " m of the cameras, at least ",
                    100 * options.min_plane_share, " % of ", least_points, " are needed");
    return region;
  }
  region.plane = towardsCameras(coefficients, world_from_cameras);
  const auto objects = clusters(grid.centers, cellsOnPlane(grid, region.plane, options),
                                options.cluster_tolerance, options.min_cells);
  if (objects.empty()) {
    region.reason =
        concatenate("no object: nothing of ", options.min_cells, " cells of ", options.cell_size,
                    " m stands ", options.min_height, " to ", options.max_height,
                    " m above the plane that holds ", 100 * share, " % of the points");
    return region;
  }
  const auto looks = countLooks(objects, grid, clouds, world_from_cameras, options.view_angle);
  const auto most = std::max_element(looks.begin(), looks.end());
  if (*most == 0) {
    region.reason =
        concatenate("no object: no frame looks at any of the ", objects.size(),
                    " things on the plane, within ", options.view_angle, " rad of its axis");
    return region;
  }
  region.is_found = true;
  region.looking_frames = *most;
  region.box = boxOnPlane(*grid.centers, objects[most - looks.begin()].indices, region.plane,
                          options.margin);
  return region;
}

Cloud
samplePoints(const RGBDFrame& frame, const CameraIntrinsics& camera, int step)
{
  std::string error;
  if (step < 1)
    throw BadArgumentException("samplePoints: step " + std::to_string(step) +
                               "; expected 1 or more");
  if (!camera.isValid(&error))
    throw BadArgumentException("samplePoints: " + error);
  if (frame.depth.type() != CV_32FC1 || frame.depth.cols != camera.width ||
      frame.depth.rows != camera.height)
    throw BadArgumentException(
        "samplePoints: depth must be CV_32FC1 in metres, of the camera's size");
  const DepthEdges edges(camera);
  Cloud cloud;
  for (int v = step; v < frame.depth.rows - 1; v += step)
    for (int u = step; u < frame.depth.cols - 1; u += step) {
      const float z = frame.depth.at<float>(v, u);
      if (!(z > 0))
        continue;
      const float limit = edges.tolerance(z);
      const auto is_near = [&](int x, int y) {
        return std::abs(frame.depth.at<float>(y, x) - z) < limit;
      };
      if (is_near(u - 1, v) && is_near(u + 1, v) && is_near(u, v - 1) && is_near(u, v + 1)) {
        const Eigen::Vector3f point = camera.unproject(u, v, z).cast<float>();
        cloud.push_back({point.x(), point.y(), point.z()});
      }
    }
  return cloud;
}

} // namespace bundle_icp
