// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
#include "surface/view_axes.h"

#include <bundle_icp/surface/preview.h>

#include <opencv2/imgproc.hpp>
#include <pcl/conversions.h>
#include <pcl/exceptions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

namespace bundle_icp {
namespace {

constexpr int supersampling = 2;
constexpr float near_plane = 0.05f; // [m]

/** A vertex as the rasteriser wants it. */
struct ScreenVertex {
  Eigen::Vector2f pixel;
  float inverse_depth = 0; ///< 0 = behind the camera
  Eigen::Vector3f color;   ///< BGR, shaded
};

bool
hasField(const pcl::PolygonMesh& mesh, const std::string& name)
{
  return std::any_of(mesh.cloud.fields.begin(), mesh.cloud.fields.end(),
                     [&name](const auto& field) { return field.name == name; });
}

void
checkArguments(const pcl::PolygonMesh& mesh, const CameraIntrinsics& camera)
{
  std::string error;
  if (!camera.isValid(&error))
    throw pcl::BadArgumentException("mesh preview: " + error);
  if (!hasField(mesh, "x") || !hasField(mesh, "y") || !hasField(mesh, "z"))
    throw pcl::BadArgumentException("mesh preview: the mesh has no x, y, z");
}

Eigen::Vector3f
colorOf(const pcl::RGB& color)
{
  return {float(color.b), float(color.g), float(color.r)};
}

std::vector<ScreenVertex>
projectVertices(const pcl::PolygonMesh& mesh, const CameraIntrinsics& camera,
                const Pose& world_from_camera)
{
  pcl::PointCloud<pcl::PointXYZ> points;
  pcl::PointCloud<pcl::RGB> colors;
  pcl::PointCloud<pcl::Normal> normals;
  pcl::fromPCLPointCloud2(mesh.cloud, points);
  if (hasField(mesh, "rgb") || hasField(mesh, "rgba"))
    pcl::fromPCLPointCloud2(mesh.cloud, colors);
  if (hasField(mesh, "normal_x"))
    pcl::fromPCLPointCloud2(mesh.cloud, normals);

  const Eigen::Isometry3f camera_from_world = world_from_camera.inverse().cast<float>();
  std::vector<ScreenVertex> vertices(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f point = camera_from_world * points[i].getVector3fMap();
    if (!(point.z() > near_plane))
      continue;
    ScreenVertex& vertex = vertices[i];
    vertex.inverse_depth = 1 / point.z();
    vertex.pixel = {float(camera.fx) * point.x() / point.z() + float(camera.cx),
                    float(camera.fy) * point.y() / point.z() + float(camera.cy)};
    vertex.color = colors.empty() ? Eigen::Vector3f::Constant(190) : colorOf(colors[i]);
    if (normals.empty())
      continue;
    const Eigen::Vector3f normal =
        camera_from_world.linear() * normals[i].getNormalVector3fMap();
    const float facing = -normal.dot(point.normalized());
    vertex.color *=
        0.7f + 0.3f * std::clamp(std::isfinite(facing) ? facing : 1.0f, 0.0f, 1.0f);
  }
  return vertices;
}

/** Picture and inverse depth. */
struct Canvas {
  cv::Mat image; ///< CV_8UC3
  cv::Mat depth; ///< CV_32FC1

  void
  draw(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c)
  {
    const Eigen::Vector2f ab = b.pixel - a.pixel, ac = c.pixel - a.pixel;
    const float area = ab.x() * ac.y() - ab.y() * ac.x();
    // Pixels run downwards: a face whose outside is seen runs clockwise on the paper.
    if (!(area < 0) || a.inverse_depth <= 0 || b.inverse_depth <= 0 ||
        c.inverse_depth <= 0)
      return;
    const auto range = [](float p, float q, float r, int size, int& first, int& last) {
      const float low = std::min({p, q, r}), high = std::max({p, q, r});
      first = static_cast<int>(std::ceil(std::max(low, 0.0f)));
      last = static_cast<int>(std::floor(std::min(high, static_cast<float>(size - 1))));
    };
    int u0, u1, v0, v1;
    range(a.pixel.x(), b.pixel.x(), c.pixel.x(), image.cols, u0, u1);
    range(a.pixel.y(), b.pixel.y(), c.pixel.y(), image.rows, v0, v1);
    for (int v = v0; v <= v1; ++v)
      for (int u = u0; u <= u1; ++u) {
        const Eigen::Vector2f ap = Eigen::Vector2f(float(u), float(v)) - a.pixel;
        const float wb = (ap.x() * ac.y() - ap.y() * ac.x()) / area;
        const float wc = (ab.x() * ap.y() - ab.y() * ap.x()) / area;
        if (wb < 0 || wc < 0 || wb + wc > 1)
          continue;
        const float inverse_depth = (1 - wb - wc) * a.inverse_depth +
                                    wb * b.inverse_depth + wc * c.inverse_depth;
        float& nearest = depth.at<float>(v, u);
        if (inverse_depth <= nearest)
          continue;
        nearest = inverse_depth;
        const Eigen::Vector3f color =
            (1 - wb - wc) * a.color + wb * b.color + wc * c.color;
        image.at<cv::Vec3b>(v, u) = {cv::saturate_cast<uchar>(color.x()),
                                     cv::saturate_cast<uchar>(color.y()),
                                     cv::saturate_cast<uchar>(color.z())};
      }
  }
};

CameraIntrinsics
enlarged(const CameraIntrinsics& camera, int factor)
{
  CameraIntrinsics large = camera;
  large.width *= factor;
  large.height *= factor;
  large.fx *= factor;
  large.fy *= factor;
  large.cx = (camera.cx + 0.5) * factor - 0.5;
  large.cy = (camera.cy + 0.5) * factor - 0.5;
  return large;
}

// Offset of the plane sign * x = tangent * z (y for axis 1) that leaves a share of the
// points on its inner side.
double
reach(const std::vector<Eigen::Vector3f>& points, int axis, int sign, double tangent,
      double share)
{
  std::vector<double> offsets;
  for (const Eigen::Vector3f& point : points)
    offsets.push_back(sign * point[axis] - tangent * point.z());
  const auto place = static_cast<std::ptrdiff_t>(share * double(offsets.size() - 1));
  std::nth_element(offsets.begin(), offsets.begin() + place, offsets.end());
  return offsets[place];
}

} // namespace

cv::Mat
renderMeshPreview(const pcl::PolygonMesh& mesh, const CameraIntrinsics& camera,
                  const Pose& world_from_camera)
{
  checkArguments(mesh, camera);
  if (!isRigid(world_from_camera.matrix()))
    throw pcl::BadArgumentException(
        "mesh preview: world_from_camera is not a rigid motion");
  const CameraIntrinsics large = enlarged(camera, supersampling);
  const std::vector<ScreenVertex> vertices =
      projectVertices(mesh, large, world_from_camera);
  Canvas canvas{cv::Mat(large.height, large.width, CV_8UC3, cv::Scalar::all(255)),
                cv::Mat(large.height, large.width, CV_32FC1, cv::Scalar(0))};
  for (const pcl::Vertices& polygon : mesh.polygons) {
    for (const auto vertex : polygon.vertices)
      if (static_cast<std::size_t>(vertex) >= vertices.size())
        throw pcl::BadArgumentException("mesh preview: a face names vertex " +
                                        std::to_string(vertex) + " of " +
                                        std::to_string(vertices.size()));
    for (std::size_t i = 2; i < polygon.vertices.size(); ++i)
      canvas.draw(vertices[polygon.vertices[0]], vertices[polygon.vertices[i - 1]],
                  vertices[polygon.vertices[i]]);
  }
  cv::Mat picture;
  cv::resize(canvas.image, picture, {camera.width, camera.height}, 0, 0,
             cv::INTER_AREA);
  return picture;
}

Pose
choosePreviewPose(const pcl::PolygonMesh& mesh, const CameraIntrinsics& camera,
                  const std::vector<Pose>& world_from_cameras)
{
  checkArguments(mesh, camera);
  Pose world_from_view = meanView(world_from_cameras);
  pcl::PointCloud<pcl::PointXYZ> points;
  pcl::fromPCLPointCloud2(mesh.cloud, points);
  if (points.empty())
    return world_from_view;

  // All but the outermost points, so that a stray piece does not make the rest tiny.
  constexpr double inner = 0.995;
  const Eigen::Isometry3f view_from_world = world_from_view.inverse().cast<float>();
  const std::size_t stride = points.size() / 100000 + 1;
  std::vector<Eigen::Vector3f> seen;
  for (std::size_t i = 0; i < points.size(); i += stride)
    seen.emplace_back(view_from_world * points[i].getVector3fMap());
  Eigen::Vector3d shift(0, 0, INFINITY);
  const double tangent[2] = {0.48 * camera.width / camera.fx,
                             0.48 * camera.height / camera.fy};
  for (int axis = 0; axis < 2; ++axis) {
    // How far the planes through the picture's two opposite sides must be moved.
    const double low = reach(seen, axis, -1, tangent[axis], inner);
    const double high = reach(seen, axis, 1, tangent[axis], inner);
    shift[axis] = (high - low) / 2;
    shift.z() = std::min(shift.z(), -(high + low) / (2 * tangent[axis]));
  }
  world_from_view.translation() += world_from_view.linear() * shift;
  return world_from_view;
}

} // namespace bundle_icp
